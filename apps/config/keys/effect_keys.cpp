// SPDX-License-Identifier: Apache-2.0
#include "apps/config/keys/robot_keys.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/config/yaml/text_file.h"

namespace twocone::config {
namespace {

/// The bounds keep a gain inside a float, limit the work of the blur, and keep a time inside its nanosecond counter.
constexpr Range kGainRange{.least = 0, .greatest = 1e6, .without_ends = true};
constexpr Range kElectronRange{.least = 0, .greatest = 1e12};
constexpr Range kDefocusRange{.least = 0, .greatest = 50};
constexpr Range kTimeRange{.least = 0, .greatest = 60};
constexpr Range kSampleRange{.least = 2, .greatest = 64};
constexpr Range kStampRange{.least = 0, .greatest = sim_povray::kMaxStampLate_s};
constexpr Range kQualityRange{.least = 0, .greatest = 100};
constexpr Range kShare{.least = 0, .greatest = 1};
/// The greatest double below 1.
constexpr Range kLossRange{
    .least = 0, .greatest = 1 - std::numeric_limits<double>::epsilon() / 2, .words = "0 to below 1"};

/// Calls visit(key, quantity, member) for each key of `effects:` except `camera`, in the order in which they are
/// written.
template <typename Visit>
void for_each_key(const Effects& /*of*/, const Visit& visit) {
  using E = Effects;
  visit("slip", {"standard deviation of a wheel's relative slip", kNoUnit, kZeroOrMore}, &E::slip);
  visit("encoder_counts_per_turn", {"encoder counts in one turn of a wheel", kNoUnit, kZeroOrMore},
        &E::encoder_counts_per_turn);
  visit("motor_lag_s", {"time constant of a wheel's speed", kSeconds, kTimeRange}, &E::motor_lag_s);
  visit("wheel_separation_m", {"true distance between the wheels' contact points", kMetres, kRobotLength},
        &E::wheel_separation_m);
  visit("wheel_radius_m", {"true radius of a wheel", kMetres, kPartLength}, &E::wheel_radius_m);
  visit("mass_kg", {"mass of the robot", kKilograms, kAboveZero}, &E::mass_kg);
  visit("wheel_friction", {"friction between wheel and floor", kNoUnit, kAboveZero}, &E::wheel_friction);
  visit("body_friction", {"friction between the body and what it touches", kNoUnit, kZeroOrMore}, &E::body_friction);
}

/// Does the same for `effects.camera` and for `effects` of one camera.
template <typename Visit>
void for_each_key(const sim_povray::CameraEffects& /*of*/, const Visit& visit) {
  using E = sim_povray::CameraEffects;
  visit("gain", {"factor on linear light", kNoUnit, kGainRange}, &E::gain);
  visit("full_well_electrons", {"electrons of a full-scale pixel", kElectrons, kElectronRange},
        &E::full_well_electrons);
  visit("read_noise_electrons", {"standard deviation of the read noise", kElectrons, kElectronRange},
        &E::read_noise_electrons);
  visit("vignetting", {"share of light lost in the corners", kNoUnit, kShare}, &E::vignetting);
  visit("defocus_px", {"radius of the circle of confusion", kPixels, kDefocusRange}, &E::defocus_px);
  visit("exposure_time_s", {"shutter time", kSeconds, kTimeRange}, &E::exposure_time_s);
  visit("readout_s", {"time from the exposure of the first row to that of the last row", kSeconds, kTimeRange},
        &E::readout_s);
  visit("shutter_samples", {"rendered images for one camera image", kNoUnit, kSampleRange}, &E::shutter_samples);
  visit("distortion", {"k1 k2 p1 p2 [k3]", kNoUnit, kAnyNumber}, &E::distortion);
  visit("distortion_focal_px", {"focal length that the distortion is for", kPixels, kZeroOrMore},
        &E::distortion_focal_px);
  visit("drop_probability", {"share of frames that are lost", kNoUnit, kLossRange}, &E::drop_probability);
  visit("late_probability", {"share of frames that come one period late", kNoUnit, kLossRange}, &E::late_probability);
  visit("stamp_late_s", {"delay of the stamp after the exposure", kSeconds, kStampRange}, &E::stamp_late_s);
  visit("colour_gain", {"factors on linear red, green and blue", kNoUnit, kGainRange}, &E::colour_gain);
  visit("flicker", {"amplitude of the lamps' light, of its mean", kNoUnit, kShare}, &E::flicker);
  visit("jpeg_quality", {"quality of the image's compression", kNoUnit, kQualityRange}, &E::jpeg_quality);
}

/// The key takes a pair, as in `rig:`. A simulated lens has only one focal length, so both must be equal.
bool read_focal_length(Section& section, std::string_view key, const Quantity& quantity, double& focal_px) {
  std::array<double, 2> pair{focal_px, focal_px};
  if (!section.number_or_list(key, quantity, pair, Need::kOptional)) return false;
  focal_px = pair[0];
  if (pair[0] == pair[1]) return true;
  section.complain(key, kPixels, "one number, or twice the same: a simulated lens has one");
  return false;
}

bool read_value(Section& section, std::string_view key, const Quantity& quantity, double& value) {
  return key == "distortion_focal_px" ? read_focal_length(section, key, quantity, value)
                                      : section.number(key, quantity, value, Need::kOptional);
}
bool read_value(Section& section, std::string_view key, const Quantity& quantity, std::optional<double>& value) {
  return section.number(key, quantity, value);
}
bool read_value(Section& section, std::string_view key, const Quantity& quantity, int& value) {
  return section.whole(key, quantity, value, Need::kOptional);
}
bool read_value(Section& section, std::string_view key, const Quantity& quantity, std::vector<double>& values) {
  constexpr std::size_t kLensCounts[] = {0, 4, 5};
  constexpr std::size_t kColourCounts[] = {0, 3};
  const std::span<const std::size_t> counts =
      key == "colour_gain" ? std::span<const std::size_t>(kColourCounts) : kLensCounts;
  return section.number_list(key, quantity, counts, values, Need::kOptional);
}

YAML::Node value_of(double number) { return YAML::Node(text_of(number)); }
YAML::Node value_of(const std::optional<double>& number) { return value_of(*number); }
YAML::Node value_of(int number) { return YAML::Node(number); }
YAML::Node value_of(const std::vector<double>& numbers) { return list_of(numbers); }

/// Overwrites `effects` with the keys that are present. Returns whether all of them were valid.
template <typename AnyEffects>
bool read_keys(Section& section, AnyEffects& effects) {
  bool good = true;
  for_each_key(effects, [&](std::string_view key, const Quantity& quantity, auto member) {
    good &= read_value(section, key, quantity, effects.*member);
  });
  return good;
}

/// Returns a copy of the mapping, or a new one. A copy is needed, because a YAML alias of the mapping must not change.
YAML::Node own_mapping(const YAML::Node& parent, const char* key) {
  const YAML::Node there = parent[key];
  return there && there.IsMap() ? YAML::Clone(there) : YAML::Node(YAML::NodeType::Map);
}

void replace(YAML::Node& parent, const char* key, const YAML::Node& mapping) {
  parent.remove(key);
  if (mapping.size() > 0) parent[key] = mapping;
}

/// Returns the effects of a camera without its own `effects`. They come from `effects.camera`.
sim_povray::CameraEffects common_effects(const YAML::Node& robot, const std::filesystem::path& file) {
  sim_povray::CameraEffects common;
  Reading reading(robot, file);
  Section* effects = reading.root().section("effects", "", Need::kOptional);
  Section* camera = effects != nullptr ? effects->section("camera", "", Need::kOptional) : nullptr;
  if (camera != nullptr) read_camera_effects(*camera, common);
  return common;
}

}  // namespace

Section* read_effects(Section& root, Effects& effects) {
  Section* section = root.section("effects", "what the simulated body does beyond the ideal", Need::kOptional);
  if (section == nullptr) return nullptr;
  read_keys(*section, effects);
  return section->section("camera", "what the cameras do beyond the ideal", Need::kOptional);
}

bool read_camera_effects(Section& section, sim_povray::CameraEffects& effects) { return read_keys(section, effects); }

void check_camera_effects(const sim_povray::CameraEffects& effects, Section* own, Section* common,
                          std::optional<double> rate_hz) {
  const auto said_in = [&](std::string_view key) -> Section* {
    if (own != nullptr && own->has(key)) return own;
    return common != nullptr && common->has(key) ? common : nullptr;
  };
  const auto complain = [&](std::string_view key, Unit unit, std::string_view rule) {
    if (Section* section = said_in(key)) section->complain(key, unit, rule);
  };
  if (effects.read_noise_electrons > 0 && said_in("full_well_electrons") == nullptr) {
    complain("read_noise_electrons", kElectrons, "absent or 0 without full_well_electrons");
  } else if (effects.read_noise_electrons > 0 && effects.full_well_electrons == 0) {
    complain("full_well_electrons", kElectrons, "> 0 where there is read_noise_electrons");
  }
  if (!effects.distortion.empty() && said_in("distortion_focal_px") == nullptr) {
    complain("distortion", kNoUnit, "absent or empty without distortion_focal_px");
  } else if (!effects.distortion.empty() && effects.distortion_focal_px == 0) {
    complain("distortion_focal_px", kPixels, "> 0 where there is a distortion");
  }
  const double takes_s = effects.exposure_time_s + effects.readout_s;
  if (rate_hz && takes_s > 0 && takes_s >= 1 / *rate_hz) {
    const bool is_exposure = effects.exposure_time_s >= effects.readout_s;
    complain(is_exposure ? "exposure_time_s" : "readout_s", kSeconds,
             fmt::format("less than a frame period, {:.6g} s, together with {}", 1 / *rate_hz,
                         is_exposure ? "readout_s" : "exposure_time_s"));
  }
}

void check_unneeded_keys(std::span<Section* const> sections) {
  const auto any_has = [&](std::string_view key) {
    return std::ranges::any_of(sections, [&](Section* section) { return section->has(key); });
  };
  const bool has_distortion = any_has("distortion");
  const bool has_time = any_has("exposure_time_s") || any_has("readout_s");
  for (Section* section : sections) {
    if (!has_distortion && section->has("distortion_focal_px")) {
      section->complain("distortion_focal_px", kPixels, "absent without distortion");
    }
    if (!has_time && section->has("shutter_samples")) {
      section->complain("shutter_samples", kNoUnit, "absent without exposure_time_s and readout_s");
    }
  }
}

void set_effects(YAML::Node& robot, const Effects& changed, const Effects& read) {
  if (changed == read) return;
  const Effects defaults;
  YAML::Node node = own_mapping(robot, "effects");
  for_each_key(defaults, [&](const char* key, const Quantity& /*quantity*/, auto member) {
    if (changed.*member == read.*member) return;
    node.remove(key);
    if (changed.*member != defaults.*member) node[key] = value_of(changed.*member);
  });
  replace(robot, "effects", node);
}

void set_camera_effects(YAML::Node& robot, const std::string& name, const drivers::CameraPart& changed,
                        const drivers::CameraPart& read, const std::filesystem::path& file) {
  if (changed.effects == read.effects) return;
  if (read.driver != drivers::kSimPovray) {
    throw FileError("{}: cameras.{}.effects cannot be changed, must be absent: driver {} has no such setting",
                    file.string(), name, read.driver);
  }
  const sim_povray::CameraEffects common = common_effects(robot, file);
  YAML::Node camera = robot["cameras"][name];
  YAML::Node node = own_mapping(camera, "effects");
  const auto has = [&](const char* key) { return bool(std::as_const(node)[key]); };
  const sim_povray::CameraEffects& now = changed.effects;
  for_each_key(now, [&](const std::string& key, const Quantity& /*quantity*/, auto member) {
    // A key on which others depend is written even if it equals the common value, because the reader rejects them
    // without it.
    const bool is_needed = key == "exposure_time_s" || key == "readout_s" || key == "distortion";
    if (now.*member != read.effects.*member) {
      if (!is_needed) node.remove(key);
      if (is_needed || now.*member != common.*member) node[key] = value_of(now.*member);
    }
    if (key == "shutter_samples" && has("shutter_samples") && now.exposure_time_s == 0 && now.readout_s == 0) {
      node["exposure_time_s"] = 0;
    }
    if (key == "distortion_focal_px" && has("distortion_focal_px") && now.distortion.empty()) {
      node["distortion"] = list_of({});
    }
  });
  replace(camera, "effects", node);
}

}  // namespace twocone::config

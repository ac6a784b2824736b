// SPDX-License-Identifier: Apache-2.0
#include "apps/config/keys/robot_keys.h"

#include <array>
#include <numbers>
#include <variant>

#include "apps/config/yaml/text_file.h"

namespace twocone::config {
namespace {

constexpr Range kApexRange{.least = 0, .greatest = std::numbers::pi, .without_ends = true, .words = "> 0 and < pi"};
constexpr Range kTiltRange{.least = -std::numbers::pi / 4,
                           .greatest = std::numbers::pi / 4,
                           .without_ends = true,
                           .words = "> -pi/4 and < pi/4"};

// Half a second, as of the stamps of a simulated camera: beyond that an image belongs to another frame.
constexpr Range kExposureRange{.least = -0.5, .greatest = 0.5};

/// The value of `calibration` with which a change of the file switches it off.
constexpr const char* kNoCalibration = "none";

void read_mirror(Section& where, RigView& view) {
  Section* mirror = where.section("mirror", "{type: cone, apex_rad}");
  if (mirror == nullptr) return;
  std::string type;
  if (mirror->text("type", "the mirror's shape, cone", type) && type != "cone") {
    mirror->complain("type", kNoUnit, "cone");
  }
  mirror->number("apex_rad", {"full angle of the cone", kRadians, kApexRange}, view.apex_rad);
}

/// A key of a mirror. In `rig:` it applies to both mirrors. In `rig.lower:` or `rig.upper:` it applies to one mirror
/// and overrides `rig:`.
struct MirrorKey {
  const char* key;
  Quantity quantity;
  std::variant<double RigView::*, std::array<double, 2> RigView::*, bool RigView::*, decltype(&read_mirror)> value;
  Need need = Need::kRequired;
  bool is_in_images = false;  ///< images show it: Rig::missing names it where the file does not state it

  void read(Section& where, RigView& view) const {
    if (!where.has(key)) return;
    if (const auto* number = std::get_if<0>(&value)) where.number(key, quantity, view.**number);
    if (const auto* pair = std::get_if<1>(&value)) where.numbers(key, quantity, view.**pair);
    if (const auto* flag = std::get_if<2>(&value)) where.flag(key, quantity.what, view.**flag);
    if (const auto* function = std::get_if<3>(&value)) (*function)(where, view);
  }
};

constexpr MirrorKey kMirrorKeys[] = {
    {"mirror", {"{type: cone, apex_rad}", kNoUnit, kAnyNumber}, &read_mirror},
    {"mirror_radius_m", {"radius R of the mirror's rim", kMetres, kPartLength}, &RigView::mirror_radius_m},
    {"lens_to_tip_m", {"distance d from the lens to the mirror's tip", kMetres, kPartLength}, &RigView::lens_to_tip_m},
    {"centre_px",
     {"column and row of the mirror's tip in the image", kPixels, kAnyNumber},
     &RigView::centre_px,
     Need::kOptional,
     true},
    {"rim_radius_px",
     {"radius of the mirror's rim in the image", kPixels, kAboveZero},
     &RigView::rim_radius_px,
     Need::kOptional,
     true},
    {"azimuth_rad",
     {"bearing of the image's x axis", kRadians, kWithinATurn},
     &RigView::azimuth_rad,
     Need::kOptional,
     true},
    {"mirrored",
     {"whether the image turns against the bearing", kNoUnit, kAnyNumber},
     &RigView::mirrored,
     Need::kOptional},
    {"tilt_rad", {"turns about the body's x and y axes", kRadians, kTiltRange}, &RigView::tilt_rad, Need::kOptional},
    {"axis_offset_m",
     {"x and y of the lens in the body's frame", kMetres, kAnyNumber},
     &RigView::axis_offset_m,
     Need::kOptional},
    {"late_s",
     {"how much later than its stamp an image's middle row is exposed", kSeconds, kExposureRange},
     &RigView::late_s,
     Need::kOptional},
    {"readout_s",
     {"time from the exposure of the first row to that of the last row", kSeconds, kExposureRange},
     &RigView::readout_s,
     Need::kOptional},
};

/// One of the two mirrors.
struct MirrorPart {
  const char* key;  ///< of its section in `rig:`
  const char* what;
  RigView* view;
  Section* section = nullptr;    ///< null: absent or unreadable
  bool is_absent = false;        ///< the file has no such section
  std::string absent_keys = {};  ///< keys that the missing section would need
};

/// Complains if neither a mirror nor `rig:` has `key`. If both mirrors lack it, there is one complaint.
void complain_missing(const MirrorKey& key, Section& rig, std::span<MirrorPart> mirrors) {
  std::vector<MirrorPart*> lacking;
  for (MirrorPart& mirror : mirrors) {
    if (mirror.is_absent || (mirror.section != nullptr && !mirror.section->has(key.key))) lacking.push_back(&mirror);
  }
  if (lacking.size() == mirrors.size()) {
    rig.complain_missing(key.key, fmt::format("{}, here for both mirrors or in lower and in upper", key.quantity.what),
                         key.quantity.unit);
    return;
  }
  for (MirrorPart* mirror : lacking) {
    if (mirror->section != nullptr) {
      mirror->section->complain_missing(key.key, key.quantity.what, key.quantity.unit);
    } else {
      mirror->absent_keys += fmt::format("{}{}", mirror->absent_keys.empty() ? "" : ", ", key.key);
    }
  }
}

/// Reads the keys of the lens, which belong together. A mirror's own `distortion` or `camera_info` replaces both keys
/// of `rig:`. @param is_distortion_common whether `rig:` sets `distortion` for both mirrors
void read_lens(Section& where, const std::filesystem::path& file, bool is_distortion_common, RigView& view) {
  const bool has_distortion = where.has("distortion");
  const bool has_file = where.has("camera_info");
  constexpr std::size_t kCounts[] = {0, 4, 5, 8};
  if (has_distortion) {
    view.camera_info.clear();
    where.number_list("distortion", {"k1 k2 p1 p2 [k3 [k4 k5 k6]]", kNoUnit, kAnyNumber}, kCounts, view.distortion);
  }
  if (has_file) {
    std::string name;
    if (where.text("camera_info", "the camera's calibration", name)) view.camera_info = resolve(name, file);
    if (has_distortion) {
      where.complain("camera_info", kNoUnit, "absent beside distortion");
    } else {
      view.distortion.clear();
      view.distortion_focal_px.reset();
      view.distortion_principal_px.reset();
    }
  }
  const auto read = [&](std::string_view key, const Quantity& quantity, bool may_be_one_number,
                        std::optional<std::array<double, 2>>& value) {
    if (!where.has(key)) return;
    std::array<double, 2> pair{};
    if (may_be_one_number ? where.number_or_list(key, quantity, pair) : where.numbers(key, quantity, pair))
      value = pair;
    if (!has_distortion && (has_file || !is_distortion_common)) {
      where.complain(key, quantity.unit, "absent without distortion");
    }
  };
  read("distortion_focal_px", {"focal lengths that the distortion is for", kPixels, kAboveZero}, true,
       view.distortion_focal_px);
  read("distortion_principal_px", {"column and row that the distortion is about", kPixels, kAnyNumber}, false,
       view.distortion_principal_px);
}

/// A key of `sigma:`.
template <typename Sigma>
struct SigmaKey {
  const char* key;
  Unit unit;
  double Sigma::*value;
};

constexpr SigmaKey<RigSigma> kRigSigmaKeys[] = {
    {"mirror_radius_m", kMetres, &RigSigma::mirror_radius_m},
    {"lens_to_tip_m", kMetres, &RigSigma::lens_to_tip_m},
    {"mirror_separation_m", kMetres, &RigSigma::mirror_separation_m},
    {"lens_height_m", kMetres, &RigSigma::lens_height_m},
    {"apex_rad", kRadians, &RigSigma::apex_rad},
    {"centre_px", kPixels, &RigSigma::centre_px},
    {"rim_radius_px", kPixels, &RigSigma::rim_radius_px},
    {"azimuth_rad", kRadians, &RigSigma::azimuth_rad},
    {"tilt_rad", kRadians, &RigSigma::tilt_rad},
    {"axis_offset_m", kMetres, &RigSigma::axis_offset_m},
    {"distortion", kNoUnit, &RigSigma::distortion},
    {"late_s", kSeconds, &RigSigma::late_s},
    {"readout_s", kSeconds, &RigSigma::readout_s},
};

constexpr SigmaKey<WheelSigma> kWheelSigmaKeys[] = {
    {"wheel_radius_m", kMetres, &WheelSigma::wheel_radius_m},
    {"wheel_separation_m", kMetres, &WheelSigma::wheel_separation_m},
    {"wheel_ratio", kNoUnit, &WheelSigma::wheel_ratio},
};

/// Reads `sigma:`, which is 0 or a mapping. A key that is absent in the mapping has the ruler's value.
/// @returns nothing if there is no such key
template <typename Sigma>
std::optional<Sigma> read_sigma(Section& where, std::span<const SigmaKey<Sigma>> keys, const Sigma& ruler) {
  constexpr Range kExact{
      .least = 0, .greatest = 0, .words = "0 (all is exact) or a mapping with a number for each key"};
  if (!where.has("sigma")) return std::nullopt;
  if (where.has_number("sigma")) {
    double zero = 0;
    where.number("sigma", {"standard deviations of these numbers", kNoUnit, kExact}, zero);
    return Sigma{};
  }
  Section* section = where.section("sigma", "standard deviations of these numbers, or 0: all is exact");
  if (section == nullptr) return std::nullopt;
  Sigma sigma = ruler;
  for (const SigmaKey<Sigma>& key : keys) {
    section->number(key.key, {"a standard deviation", key.unit, kZeroOrMore}, sigma.*key.value, Need::kOptional);
  }
  return sigma;
}

template <typename Sigma>
YAML::Node sigma_node(const Sigma& sigma, std::span<const SigmaKey<Sigma>> keys) {
  if (sigma == Sigma{}) return YAML::Node(0);
  YAML::Node node;
  for (const SigmaKey<Sigma>& key : keys) node[key.key] = text_of(sigma.*key.value);
  return node;
}

}  // namespace

void read_rig(Section& root, const std::filesystem::path& file, Rig& rig) {
  Section* section = root.section("rig", "the two mirrors as the robot believes them to be");
  if (section == nullptr) return;
  section->number("mirror_separation_m", {"distance s between the two mirrors' tips", kMetres, kAboveZero},
                  rig.mirror_separation_m);
  section->number("lens_height_m", {"lower lens above the floor", kMetres, kZeroOrMore}, rig.lens_height_m);

  RigView common;
  for (const MirrorKey& key : kMirrorKeys) key.read(*section, common);
  read_lens(*section, file, false, common);
  MirrorPart mirrors[] = {{"lower", "the lower mirror, with its", &rig.lower},
                          {"upper", "the upper mirror, with its", &rig.upper}};
  for (MirrorPart& mirror : mirrors) {
    *mirror.view = common;
    mirror.is_absent = !section->has(mirror.key);
    mirror.section = section->section(mirror.key, mirror.what, Need::kOptional);
    if (mirror.section == nullptr) continue;
    for (const MirrorKey& key : kMirrorKeys) key.read(*mirror.section, *mirror.view);
    read_lens(*mirror.section, file, section->has("distortion"), *mirror.view);
  }
  for (const MirrorKey& key : kMirrorKeys) {
    if (key.need == Need::kRequired && !section->has(key.key)) complain_missing(key, *section, mirrors);
  }
  for (const MirrorPart& mirror : mirrors) {
    if (!mirror.absent_keys.empty()) {
      section->complain_missing(mirror.key, fmt::format("{} {}", mirror.what, mirror.absent_keys));
    }
  }
  for (const MirrorPart& mirror : mirrors) {
    for (const MirrorKey& key : kMirrorKeys) {
      const bool is_own = mirror.section != nullptr && mirror.section->has(key.key);
      if (!key.is_in_images || is_own || section->has(key.key)) continue;
      rig.missing.push_back(fmt::format("{}.{}", mirror.key, key.key));
    }
  }
  rig.sigma = read_sigma<RigSigma>(*section, kRigSigmaKeys, ruler_sigma(rig));
  std::string calibration;
  section->text("calibration", "the covariance that `twocone calibrate` wrote", calibration, Need::kOptional);
  if (calibration.empty() || calibration == kNoCalibration) return;
  rig.calibration = resolve(calibration, file);
  if (rig.sigma) section->complain("sigma", kNoUnit, "absent beside calibration");
}

void read_wheel_sigma(Section& drive_section, Drive& drive) {
  drive.sigma = read_sigma<WheelSigma>(drive_section, kWheelSigmaKeys, ruler_sigma(drive));
}

YAML::Node sigma_of(const RigSigma& sigma) { return sigma_node<RigSigma>(sigma, kRigSigmaKeys); }
YAML::Node sigma_of(const WheelSigma& sigma) { return sigma_node<WheelSigma>(sigma, kWheelSigmaKeys); }

RigSigma ruler_sigma(const Rig& rig) {
  constexpr double kDegree = std::numbers::pi / 180;
  return {.mirror_radius_m = 0.002,
          .lens_to_tip_m = 0.002,
          .mirror_separation_m = 0.003,
          .lens_height_m = 0.003,
          .apex_rad = 0.5 * kDegree,
          .centre_px = 10,
          .rim_radius_px = 0.03 * (rig.lower.rim_radius_px + rig.upper.rim_radius_px) / 2,
          .azimuth_rad = 3 * kDegree,
          .tilt_rad = 1 * kDegree,
          .axis_offset_m = 0.003,
          .late_s = 0.01,
          .readout_s = 0.01,
          .distortion = 0.02};
}

WheelSigma ruler_sigma(const Drive& drive) {
  return {.wheel_radius_m = 0.03 * drive.wheel_radius_m, .wheel_separation_m = 0.005, .wheel_ratio = 0.01};
}

void make_rig_paths_absolute(YAML::Node& robot, const std::filesystem::path& file) {
  const auto make_absolute = [&](YAML::Node path) {
    if (path && path.as<std::string>() != kNoCalibration)
      path = std::filesystem::absolute(resolve(path.as<std::string>(), file)).string();
  };
  YAML::Node rig = robot["rig"];
  make_absolute(rig["camera_info"]);
  make_absolute(rig["calibration"]);
  for (const char* const mirror : {"lower", "upper"}) {
    if (rig[mirror]) make_absolute(rig[mirror]["camera_info"]);
  }
}

}  // namespace twocone::config

// SPDX-License-Identifier: Apache-2.0
#include "apps/config/keys/camera_effects.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

#include <fmt/format.h>

namespace twocone::config {
namespace {

/// The bounds keep a gain inside a float, limit the work of the blur, and keep a time inside its nanosecond counter.
constexpr Range kGainRange{.least = 0, .greatest = 1e6, .without_ends = true};
constexpr Range kElectronRange{.least = 0, .greatest = 1e12};
constexpr Range kDefocusRange{.least = 0, .greatest = 50};
constexpr Range kExposureRange{.least = 0, .greatest = 60};
constexpr Range kStampRange{.least = 0, .greatest = sim_povray::kMaxStampLate_s};
constexpr Range kShare{.least = 0, .greatest = 1};
/// The greatest double below 1.
constexpr Range kLossRange{
    .least = 0, .greatest = 1 - std::numeric_limits<double>::epsilon() / 2, .words = "0 to below 1"};

}  // namespace

bool read_camera_effects(Section& section, sim_povray::CameraEffects& effects) {
  bool good = true;
  const auto read = [&](std::string_view key, const Quantity& quantity, double& value) {
    good &= section.number(key, quantity, value, Need::kOptional);
  };
  read("gain", {"factor on linear light", kNoUnit, kGainRange}, effects.gain);
  read("full_well_electrons", {"electrons of a full-scale pixel", kElectrons, kElectronRange},
       effects.full_well_electrons);
  read("read_noise_electrons", {"standard deviation of the read noise", kElectrons, kElectronRange},
       effects.read_noise_electrons);
  read("vignetting", {"share of light lost in the corners", kNoUnit, kShare}, effects.vignetting);
  read("defocus_px", {"radius of the circle of confusion", kPixels, kDefocusRange}, effects.defocus_px);
  read("exposure_time_s", {"shutter time", kSeconds, kExposureRange}, effects.exposure_time_s);
  read("readout_s", {"time from the exposure of the first row to that of the last row", kSeconds, kExposureRange},
       effects.readout_s);
  good &=
      section.whole("shutter_samples", {"rendered images for one camera image", kNoUnit, {.least = 2, .greatest = 64}},
                    effects.shutter_samples, Need::kOptional);
  constexpr std::size_t kCounts[] = {0, 4, 5};
  good &= section.number_list("distortion", {"k1 k2 p1 p2 [k3]", kNoUnit, kAnyNumber}, kCounts, effects.distortion,
                              Need::kOptional);
  // The key takes a pair, as in `rig:`. A simulated lens has only one focal length, so both must be equal.
  std::array<double, 2> focal_px{effects.distortion_focal_px, effects.distortion_focal_px};
  if (section.number_or_pair("distortion_focal_px", {"focal length that the distortion is for", kPixels, kZeroOrMore},
                             focal_px, Need::kOptional)) {
    effects.distortion_focal_px = focal_px[0];
    if (focal_px[0] != focal_px[1]) {
      section.complain("distortion_focal_px", kPixels, "one number, or twice the same: a simulated lens has one");
      good = false;
    }
  } else {
    good = false;
  }
  read("drop_probability", {"share of frames that are lost", kNoUnit, kLossRange}, effects.drop_probability);
  read("late_probability", {"share of frames that come one period late", kNoUnit, kLossRange},
       effects.late_probability);
  read("stamp_late_s", {"delay of the stamp after the exposure", kSeconds, kStampRange}, effects.stamp_late_s);
  return good;
}

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
    return std::any_of(sections.begin(), sections.end(), [&](Section* section) { return section->has(key); });
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

}  // namespace twocone::config

// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/comparison.h"

#include <algorithm>
#include <array>

namespace twocone::compare {
namespace {

struct CauseWords {
  Cause cause;
  std::string_view name, advice;
};
constexpr std::string_view kRig =
    "put the real numbers into the real robot's `rig:` (--write-robot does), or move camera and mirror";
constexpr std::string_view kDrive = "put the real numbers into `drive:` (--write-robot does)";
constexpr std::string_view kRate = "set the cameras' rate, or trigger both together; in the simulation set rate_hz";
constexpr std::string_view kStamps = "correct the stamps, or trigger both together; in the simulation set stamp_late_s";
constexpr std::array<CauseWords, 20> kCauses{{
    {Cause::kFocalLength, "focal length", kRig},
    {Cause::kCentre, "centre", kRig},
    {Cause::kTilt, "tilt", kRig},
    {Cause::kMirrorShape, "mirror shape", kRig},
    {Cause::kRollingShutter, "rolling shutter",
     "use a shorter readout or slower turns; in the simulation set readout_s"},
    {Cause::kMirrorsAlignment, "mirrors' alignment", kRig},
    {Cause::kMirrorsHeights, "mirrors' heights", kRig},
    {Cause::kSkew, "skew", kStamps},
    {Cause::kLatency, "latency", kStamps},
    {Cause::kWheelRadius, "wheel radius", kDrive},
    {Cause::kWheelRatio, "wheel ratio", kDrive},
    {Cause::kWheelSeparation, "wheel separation", kDrive},
    {Cause::kSlip, "slip", "check floor and tyres; in the simulation set slip"},
    {Cause::kLandmark, "landmark", "measure this landmark again: its place in the real map is wrong"},
    {Cause::kExposureAndColour, "exposure and colour",
     "set exposure, gain and white balance; in the simulation set gain, vignetting"},
    {Cause::kNoise, "noise", "use more light; in the simulation set full_well_electrons, read_noise_electrons"},
    {Cause::kSharpness, "sharpness", "focus the lens; in the simulation set defocus_px"},
    {Cause::kFramesLost, "frames lost",
     "check cable, bus and load (twocone doctor); in the simulation set drop_probability"},
    {Cause::kFrameRate, "frame rate", kRate},
    {Cause::kStampedSkew, "stamped skew", kRate},
}};

const CauseWords& words_of(Cause cause) { return *std::ranges::find(kCauses, cause, &CauseWords::cause); }

/// Returns the name of an enumerator. @param names in the order of the enumerators
template <typename Enum, std::size_t N>
std::string_view name_in(const std::array<std::string_view, N>& names, Enum value) {
  return names.at(std::size_t(value));
}

}  // namespace

std::string_view to_string(Cause cause) { return words_of(cause).name; }
std::string_view advice_for(Cause cause) { return words_of(cause).advice; }

std::string_view to_string(Light light) {
  return name_in(std::array<std::string_view, 5>{"none", "green", "amber", "red", "cannot tell"}, light);
}

std::string_view to_string(Stage stage) {
  return name_in(std::array<std::string_view, 9>{"image", "detection", "disparity", "range", "bearing", "fix",
                                                 "odometry", "trajectory", "timing"},
                 stage);
}

std::string_view to_string(Quantity quantity) {
  return name_in(std::array<std::string_view, 4>{"range", "odometry", "brightness", "noise"}, quantity);
}

std::string_view to_string(SourceVerdict verdict) {
  return name_in(std::array<std::string_view, 3>{"differs", "agrees", "cannot tell"}, verdict);
}

std::string unit_after(std::string_view before, const std::string& unit) {
  constexpr std::string_view kNumber = "1";
  return unit.empty() || unit == kNumber ? "" : std::string(before) + unit;
}

std::string Source::name() const {
  const std::string place = where(), what(to_string(cause));
  return place.empty() ? what : place + " " + what;
}

const Source* find_source(const std::vector<Source>& sources, Cause cause, std::optional<vision::Side> view) {
  const auto at = std::ranges::find_if(sources, [&](const Source& s) { return s.cause == cause && s.view == view; });
  return at == sources.end() ? nullptr : &*at;
}

const Source* find_differing(const std::vector<Source>& sources, Cause cause, std::optional<vision::Side> view) {
  const Source* const source = find_source(sources, cause, view);
  return source && source->differs() ? source : nullptr;
}

bool Comparison::is_within_limits() const {
  return std::ranges::none_of(
      rows, [](Light light) { return light == Light::kAmber || light == Light::kRed; }, &Row::light);
}

std::vector<const Source*> Comparison::sources_with(SourceVerdict verdict) const {
  std::vector<const Source*> found;
  for (const Source& source : sources) {
    if (source.verdict == verdict) found.push_back(&source);
  }
  return found;
}

}  // namespace twocone::compare

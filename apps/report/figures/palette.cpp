// SPDX-License-Identifier: Apache-2.0
#include "apps/report/figures/palette.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace twocone::report {
namespace {

/// Luminance at which a colour's contrast with white is 3 to 1, as WCAG 2.1 requires of graphics: (1 + 0.05) / (Y +
/// 0.05).
constexpr double kLightestLine = 0.30;

int srgb_code(double linear) {
  const double value = std::isfinite(linear) ? std::clamp(linear, 0.0, 1.0) : 0.0;
  const double coded = value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1 / 2.4) - 0.055;  // IEC 61966-2-1
  return static_cast<int>(std::lround(255 * coded));
}

/// A verdict of a range or a fix. Each method explains it in its own terms: `meaning` is that of method `outline`.
struct Verdict {
  std::string_view name, colour, meaning;
  std::string_view of_paper{};  ///< meaning of method `paper`, where it is another one
};

const Verdict* find_verdict(std::string_view name) {
  static constexpr std::array<Verdict, 19> kVerdicts{
      {{"ok", "#009e73", "an answer"},
       {"gap", "#56b4e9",
        "a position, although two circles did not meet: the middle of the gap between them was taken"},
       {"ambiguous", "#cc79a7", "two positions fit the measurements equally well",
        "two positions fit the three ranges equally well"},
       {"not_seen", "#999999", "nothing of its colour in either mirror", "nothing of its colour in the lower mirror"},
       {"too_few", "#999999", "too few measurements to determine a position", "fewer than three ranges"},
       {"truncated", "#e69f00", "it reaches the rims: too near for its top to be seen",
        "it reaches the lower rim: too near for its top to be seen"},
       {"no_match", "#0072b2", "seen, but its outline could not be fitted",
        "seen in the lower mirror, not found in the upper one"},
       {"beyond_limit", "#d55e00", "too far: within 3 sigma the images do not distinguish its range from infinity",
        "too far: its disparity is not positive"},
       {"same_colour", "#f0e442", "another landmark has this colour"},
       {"one_view", "#8fce9f", "a range from one mirror and the known height of the top"},
       {"occluded", "#7a5195",
        "something hides a part of its outline: a range without a bearing where its top is whole, else none"},
       {"saturated", "#f2c14e", "too bright: its colour cannot be recognised"},
       {"two_candidates", "#cc79a7", "two objects of its colour, and the images do not show which one it is"},
       {"inconsistent", "#a3333d", "the two mirrors contradict each other, or the map's height and radius"},
       {"impossible", "#5c3a21", "no position of a landmark gives these images"},
       {"weak", "#56b4e9", "a position that is hardly determined along one direction"},
       {"contradictory", "#a3333d", "the measurements contradict each other, and it is unknown which one is wrong"},
       {"out_of_bounds", "#5c3a21", "a position outside the map's bounds, where the robot cannot be"},
       {"no_image", "#5b4a8a", "an image of the frame is missing or damaged"}}};
  const auto* found =
      std::find_if(kVerdicts.begin(), kVerdicts.end(), [&](const Verdict& v) { return v.name == name; });
  return found == kVerdicts.end() ? nullptr : found;
}

}  // namespace

std::string own_colour(const std::array<double, 3>& colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", srgb_code(colour[0]), srgb_code(colour[1]), srgb_code(colour[2]));
}

std::string line_colour(const std::array<double, 3>& colour) {
  const double luminance = 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2];  // ITU-R BT.709
  const double factor = luminance > kLightestLine ? kLightestLine / luminance : 1.0;
  return own_colour({colour[0] * factor, colour[1] * factor, colour[2] * factor});
}

std::string verdict_colour(std::string_view verdict) {
  const Verdict* known = find_verdict(verdict);
  return known != nullptr ? std::string(known->colour) : "#5b4a8a";
}

std::string_view verdict_meaning(std::string_view verdict, std::string_view method) {
  const Verdict* known = find_verdict(verdict);
  if (known == nullptr) return "";
  return method == "paper" && !known->of_paper.empty() ? known->of_paper : known->meaning;
}

}  // namespace twocone::report

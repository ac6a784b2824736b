// SPDX-License-Identifier: Apache-2.0
#include "apps/report/page.h"

#include <algorithm>
#include <array>

#include "apps/estimation/method.h"
#include "localisation/fix.h"
#include "vision/ranging.h"

namespace twocone::report {
namespace {

/// A verdict of a range or a fix. Each method explains it in its own terms: `meaning` is that of method `outline`.
struct Verdict {
  std::string_view name, colour, meaning;
  std::string_view of_paper{};  ///< meaning of method `paper`, where it is another one
};

const Verdict* find_verdict(std::string_view name) {
  using localisation::FixVerdict;
  using vision::RangeVerdict;
  static const std::array<Verdict, 19> kVerdicts{
      {{to_string(RangeVerdict::kOk), "#009e73", "an answer"},
       {to_string(FixVerdict::kGap), "#56b4e9",
        "a position, although two circles did not meet: the middle of the gap between them was taken"},
       {to_string(FixVerdict::kAmbiguous), "#cc79a7", "two positions fit the measurements equally well",
        "two positions fit the three ranges equally well"},
       {to_string(RangeVerdict::kNotSeen), "#999999", "nothing of its colour in either mirror",
        "nothing of its colour in the lower mirror"},
       {to_string(FixVerdict::kTooFew), "#999999", "too few measurements to determine a position",
        "fewer than three ranges"},
       {to_string(RangeVerdict::kTruncated), "#e69f00", "it reaches the rims: too near for its top to be seen",
        "it reaches the lower rim: too near for its top to be seen"},
       {to_string(RangeVerdict::kNoMatch), "#0072b2", "seen, but its outline could not be fitted",
        "seen in the lower mirror, not found in the upper one"},
       {to_string(RangeVerdict::kBeyondLimit), "#d55e00",
        "too far: within 3 sigma the images do not distinguish its range from infinity",
        "too far: its disparity is not positive"},
       {to_string(RangeVerdict::kSameColour), "#f0e442", "another landmark has this colour"},
       {to_string(RangeVerdict::kOneView), "#8fce9f", "a range from one mirror and the known height of the top"},
       {to_string(RangeVerdict::kOccluded), "#7a5195",
        "something hides a part of its outline: a range without a bearing where its top is whole, else none"},
       {to_string(RangeVerdict::kSaturated), "#f2c14e", "too bright: its colour cannot be recognised"},
       {to_string(RangeVerdict::kTwoCandidates), "#cc79a7",
        "two objects of its colour, and the images do not show which one it is"},
       {to_string(RangeVerdict::kInconsistent), "#a3333d",
        "the two mirrors contradict each other, or the map's height and radius"},
       {to_string(RangeVerdict::kImpossible), "#5c3a21", "no position of a landmark gives these images"},
       {to_string(FixVerdict::kWeak), "#56b4e9", "a position that is hardly determined along one direction"},
       {to_string(FixVerdict::kContradictory), "#a3333d",
        "the measurements contradict each other, and it is unknown which one is wrong"},
       {to_string(FixVerdict::kOutOfBounds), "#5c3a21",
        "a position outside the map's bounds, where the robot cannot be"},
       {"no_image", "#5b4a8a", "an image of the frame is missing or damaged"}}};
  const auto* found = std::ranges::find(kVerdicts, name, &Verdict::name);
  return found == kVerdicts.end() ? nullptr : found;
}

}  // namespace

std::string verdict_colour(std::string_view verdict) {
  const Verdict* known = find_verdict(verdict);
  return known != nullptr ? std::string(known->colour) : "#5b4a8a";
}

std::string_view verdict_meaning(std::string_view verdict, std::string_view method) {
  const Verdict* known = find_verdict(verdict);
  if (known == nullptr) return "";
  return method == to_string(estimation::Method::kPaper) && !known->of_paper.empty() ? known->of_paper : known->meaning;
}

}  // namespace twocone::report

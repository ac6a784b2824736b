// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/plane.h"
#include "vision/sighting.h"

namespace twocone::vision {

/// The reason why a range is given or withheld.
enum class RangeVerdict {
  kOk,
  kNotSeen,      ///< no pixel of its colour in the lower mirror
  kTruncated,    ///< its colour reaches the lower rim: the top lies outside the mirror, the landmark is too near
  kNoMatch,      ///< seen in the lower mirror, but not on the line to the centre in the upper one
  kBeyondLimit,  ///< the disparity is not positive: farther than the views can measure
  kSameColour,   ///< another landmark has this hue, so the two cannot be distinguished
  kOneView,      ///< given, from one view and the top's known height: the other view does not show the top
  kOccluded,     ///< something hides a part of the outline: given without bearing where the top is whole, else withheld
  kSaturated,    ///< too bright: its colour is lost, so its outline is not trusted
  kTwoCandidates,  ///< two objects of its colour are seen, and nothing shows which one is the landmark
  kInconsistent,   ///< the two views contradict each other, or the map's height and radius of the landmark
  kImpossible,     ///< no place in the world gives these radii
};
/// Returns the name in ranges.csv: ok, not_seen, truncated, no_match, beyond_limit, same_colour, one_view, occluded,
/// saturated, two_candidates, inconsistent, impossible.
std::string_view to_string(RangeVerdict verdict);

/// The measurement of one landmark in one stereo frame. Fields without an answer are empty.
struct RangeMeasurement {
  RangeVerdict verdict = RangeVerdict::kNotSeen;
  std::optional<double> range_m;        ///< horizontal distance from the mirrors' axis to the landmark's axis
  std::optional<double> sigma_range_m;  ///< where the method states one
  std::optional<double> bearing_rad;    ///< in the body frame, (-pi, pi]
  std::optional<double> sigma_bearing_rad;
  std::optional<double> disparity_px;       ///< radial, lower minus upper
  std::optional<Eigen::Vector2d> lower_px;  ///< column, row of the match
  std::optional<Eigen::Vector2d> upper_px;
  std::optional<Eigen::Matrix2d> covariance;  ///< of (range m, bearing rad), where the method states one
  std::optional<Sighting> lower_sighting;     ///< where the method makes them
  std::optional<Sighting> upper_sighting;
};

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace twocone::vision {

/// What there is to look for: an upright cylinder of one colour.
struct Target {
  std::string name;
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();  ///< linear rgb; its hue counts
  double radius_m = 0;                               ///< > 0
};

/// Why a range is given or withheld.
enum class RangeVerdict {
  kOk,
  kNotSeen,      ///< no pixel of its colour in the lower mirror
  kTruncated,    ///< its colour reaches the lower rim: the top lies outside the mirror, the landmark is too near
  kNoMatch,      ///< seen in the lower mirror, but not on the line to the centre in the upper one
  kBeyondLimit,  ///< the disparity is not positive: farther than the views can tell
  kSameColour,   ///< another landmark has this hue, so neither can be told from the other
};
/// As in ranges.csv: ok, not_seen, truncated, no_match, beyond_limit, same_colour.
std::string_view to_string(RangeVerdict verdict);

/// One landmark in one stereo frame. Fields without an answer are empty.
struct RangeMeasurement {
  RangeVerdict verdict = RangeVerdict::kNotSeen;
  std::optional<double> range_m;        ///< horizontal distance from the mirrors' axis to the landmark's axis
  std::optional<double> sigma_range_m;  ///< where the method states one
  std::optional<double> bearing_rad;    ///< in the body frame, (-pi, pi]
  std::optional<double> sigma_bearing_rad;
  std::optional<double> disparity_px;       ///< radial, lower minus upper
  std::optional<Eigen::Vector2d> lower_px;  ///< column, row of the match
  std::optional<Eigen::Vector2d> upper_px;
};

}  // namespace twocone::vision

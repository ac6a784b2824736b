// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// What an axis buys and costs, from all pairs of settings that differ in nothing else.
struct Conclusion {
  Axis axis;
  /// "anti-aliasing: from none to +R2 the error falls to 0.41 times (0.35 to 0.48, 12 pairs) for 1.9 times the
  /// simulation time; beyond +R2 it buys nothing here: from +R2 to +R3 the error is 1.02 times (0.93 to 1.11, 12 pairs)
  /// for 1.4 times the simulation time"
  std::string sentence;
};
/// One for each axis on which the sweep has at least two values, in the order of Axis. Steps go to the axis's next
/// value, in order of size (of levels, in the order of Level), of those that enough settings have; to adaptive
/// precision from the uniform kFine, to other effects from the scene's own. Settings that answer less often than
/// kLeastAnswered are left out; a value that goes with them is named.
///
/// A step's ratio of mean position errors is the geometric mean over pairs. Its 95 % interval is Student's over the
/// pairs' logarithms or that of the pairs' own intervals, taken as independent, whichever is wider to that side. (They
/// are not: within a pair the legs are common, which makes it too wide, and between pairs too, which makes it too
/// narrow.) The cost is robot_time_s(), of size, anti-aliasing and effects simulation_time_s().
///
/// "Buys nothing" is said where the interval holds 1 ("that so few legs could show" where it reaches below 0.8), "costs
/// no accuracy" where moreover the cost is less, by its interval; "costs accuracy" where the interval lies above 1.
std::vector<Conclusion> conclusions(const Sweep& sweep);

/// How error and time grow along an axis that has a size: exponents of a power law by weighted least squares over
/// log-log within groups of settings that differ in nothing else, each group with a factor of its own; with 95 %
/// intervals from the figures' own or from the scatter about the law, whichever is wider. Axes: pixels of a picture
/// (error, vision, rendering), landmarks (error, vision), frames (error). Times are medians, errors means. No Growth
/// where no group has two sizes.
struct Growth {
  Axis axis{};
  std::string of;  ///< "position error", "vision time", "rendering time"
  double exponent = 0;
  double low = 0, high = 0;
  int points = 0;
};
std::vector<Growth> growth(const Sweep& sweep);

}  // namespace twocone::tradeoff

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// Returns effect and cost of each axis on which the sweep has at least two values, in a sentence, from all pairs of
/// settings that differ in nothing else:
///
///     anti-aliasing: from none to +R2 the error falls to 0.41 times (0.35 to 0.48, 12 pairs) at 1.9 times the
///     simulation time; beyond +R2 no gain in accuracy was found: from +R2 to +R3 the error is 1.02 times (0.93
///     to 1.11, 12 pairs) at 1.4 times the simulation time
///
/// Steps go to the next value of the axis, in order of size (levels: in the order of Level), among the values that
/// enough settings have. Steps to adaptive precision begin at the uniform kFine, steps to other effects at those of the
/// scene. Settings that answer less often than kLeastAnswered are left out; a value that only such settings have is
/// named.
///
/// A step's ratio of mean position errors is the geometric mean over pairs. Its 95 % interval is Student's over the
/// pairs' logarithms or that of the pairs' own intervals, taken as independent, whichever is wider on that side. (They
/// are not independent: within a pair the episodes are common, which makes it too wide, and between pairs too, which
/// makes it too narrow.) The cost is robot_time_s(); for size, anti-aliasing and effects it is simulation_time_s().
///
/// A ratio whose interval excludes 1 is an effect: "the error falls to" or "rises to". Otherwise "no effect on the
/// error was found"; where the interval reaches beyond 0.8 to 1.25, the sentence adds that an effect is not excluded.
/// Where there are too few episodes for an interval, the sentence states only the measured ratio.
std::map<Axis, std::string> conclusions(const Sweep& sweep);

/// Growth of error and time along an axis that has a size. Exponents of a power law come from weighted least squares
/// over log-log within groups of settings that differ in nothing else; each group has its own factor. Their 95 %
/// intervals come from the figures' own intervals or from the scatter about the law, whichever is wider. Axes: pixels
/// of an image (error, vision, rendering), landmarks (error, vision), frames (error). Times are medians, errors are
/// means. There is no Growth where no group has two sizes.
struct Growth {
  Axis axis{};
  std::string of;  ///< "position error", "vision time", "rendering time"
  double exponent = 0;
  double low = 0, high = 0;
  int points = 0;
};
std::vector<Growth> growth(const Sweep& sweep);

}  // namespace twocone::tradeoff

// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace twocone::localisation {

/// Returns the probability that chi-squared of `degrees_of_freedom` (>= 1) standard normal numbers is at least `value`.
///
/// It is computed by Boost.Math in double, and is accurate to some tens of roundings up to 100 degrees of freedom. The
/// result is 1 for a value <= 0, and 0 for NaN and infinity.
double chi_squared_tail(double value, int degrees_of_freedom);

}  // namespace twocone::localisation

// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace twocone::localisation {

/// The probability that chi-squared of `degrees_of_freedom` (>= 1) standard normal numbers is at least `value`.
///
/// By Boost.Math, in double: accurate to some tens of roundings up to 100 degrees of freedom. The result is 1 for a
/// value
/// <= 0, and 0 for NaN and infinity.
double chi_squared_tail(double value, int degrees_of_freedom);

}  // namespace twocone::localisation

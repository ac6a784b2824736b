// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace twocone::localisation {

/// The probability that chi-squared of `degrees_of_freedom` (>= 1) standard normal numbers is at least `value`.
///
/// It is exact to some ten roundings up to 100 degrees of freedom (finite sums, Abramowitz & Stegun 26.4.4 and 26.4.5).
/// Beyond, it uses Wilson and Hilferty's cube root, whose relative error is then below 3 % at 1e-4. The result is 1 for
/// a value <= 0, and 0 for NaN.
double chi_squared_tail(double value, int degrees_of_freedom);

}  // namespace twocone::localisation

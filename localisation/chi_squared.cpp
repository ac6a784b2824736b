// SPDX-License-Identifier: Apache-2.0
#include "localisation/chi_squared.h"

#include <cmath>
#include <numbers>

namespace twocone::localisation {

double chi_squared_tail(double value, int degrees_of_freedom) {
  if (std::isnan(value)) return 0;
  if (value <= 0) return 1;
  const double half = value / 2;
  if (degrees_of_freedom > 100) {
    const double spread = 2 / (9.0 * degrees_of_freedom);
    const double normal = (std::cbrt(value / degrees_of_freedom) - (1 - spread)) / std::sqrt(spread);
    return std::erfc(normal / std::numbers::sqrt2) / 2;
  }
  const bool odd = degrees_of_freedom % 2 != 0;
  // Each term follows from the one before: half^k / k!, with k an integer or a half-integer.
  double k = odd ? 0.5 : 0;
  double term = std::exp(-half) * (odd ? 2 * std::sqrt(half) * std::numbers::inv_sqrtpi : 1);
  double sum = odd ? std::erfc(std::sqrt(half)) : 0;
  for (int left = degrees_of_freedom / 2; left > 0; --left) {
    sum += term;
    k += 1;
    term *= half / k;
  }
  return sum;
}

}  // namespace twocone::localisation

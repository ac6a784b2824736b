// SPDX-License-Identifier: Apache-2.0
#include "vision/alike_radii.h"

#include <algorithm>
#include <cmath>

namespace twocone::vision {

std::optional<LogRadius> as_the_others(std::span<const LogRadius> radii, std::size_t one) {
  double count = 0;
  double weights = 0;
  double squared_weights = 0;
  double sum = 0;
  double squares = 0;
  for (std::size_t i = 0; i < radii.size(); ++i) {
    if (i == one || radii[i].variance == 0) continue;
    const double weight = 1 / radii[i].variance;
    count += 1;
    weights += weight;
    squared_weights += weight * weight;
    sum += weight * radii[i].mean;
    squares += weight * radii[i].mean * radii[i].mean;
  }
  if (count < 2) return std::nullopt;
  const double mean = sum / weights;
  const double chi_squared = squares - weights * mean * mean;
  const double freedom = count - 1;
  const double excess = std::max(0.0, chi_squared - freedom) + std::sqrt(2 * freedom);
  return LogRadius{mean, excess / (weights - squared_weights / weights) + 1 / weights};
}

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace twocone::base {

/// Returns the quantile by nearest rank: the smallest of `values` such that at least `share` of them are not above it.
/// Requires `share` in (0, 1] and `values` that are not empty.
inline double quantile(std::vector<double> values, double share) {
  assert(!values.empty());
  const auto rank = std::size_t(std::ceil(share * double(values.size())));
  const auto place = values.begin() + std::ptrdiff_t(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// Returns the median, which is the upper one of the two middle values of an even number. `values` is not empty.
template <typename T>
T median(std::vector<T> values) {
  assert(!values.empty());
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns the standard deviation of the Gaussian whose distances from its middle have the median of these: a few wild
/// ones hardly change it. `distances` is not empty, and none is below 0.
inline double robust_sigma(std::vector<double> distances) {
  constexpr double kSigmasPerMedian = 1.4826;  // 1 / Phi^-1(3 / 4)
  return kSigmasPerMedian * median(std::move(distances));
}

}  // namespace twocone::base

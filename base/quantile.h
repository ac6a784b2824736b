// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <vector>

namespace twocone::base {

/// The quantile by nearest rank: the smallest of `values` such that at least `share` of them are not above it.
/// `share` is in (0, 1]; `values` is not empty.
inline double quantile(std::vector<double> values, double share) {
  assert(!values.empty());
  const auto rank = std::size_t(std::ceil(share * double(values.size())));
  const auto place = values.begin() + std::ptrdiff_t(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// The middle value in order; the upper one of the two in the middle. `values` is not empty.
template <typename T>
T median(std::vector<T> values) {
  assert(!values.empty());
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace twocone::base

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <vector>

namespace twocone::runs {

/// The smallest of the values that `share` of them, in (0, 1], are not above (nearest rank). Of at least one value.
inline double quantile(std::vector<double> values, double share) {
  assert(!values.empty());
  const auto rank = std::size_t(std::ceil(share * double(values.size())));
  const auto place = values.begin() + std::ptrdiff_t(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace twocone::runs

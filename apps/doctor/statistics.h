// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace twocone::doctor {

/// The least value that `share` of all do not exceed. @param values not empty @param share in (0, 1]
inline double quantile(std::vector<double> values, double share) {
  assert(!values.empty());
  const auto rank = std::size_t(std::ceil(share * double(values.size())));
  const auto at = values.begin() + std::ptrdiff_t(std::clamp(rank, std::size_t{1}, values.size()) - 1);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

inline double median(const std::vector<double>& values) { return quantile(values, 0.5); }
inline double greatest(const std::vector<double>& values) { return quantile(values, 1); }

}  // namespace twocone::doctor

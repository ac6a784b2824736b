// SPDX-License-Identifier: Apache-2.0
#include "apps/import/pairing.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <tuple>

#include "base/quantile.h"

namespace twocone::importer {

std::optional<Stamp> median_period(const std::vector<Stamp>& times) {
  if (times.size() < 2) return std::nullopt;
  std::vector<Stamp> periods;
  for (std::size_t i = 1; i < times.size(); ++i) periods.push_back(times[i] - times[i - 1]);
  return base::median(std::move(periods));
}

std::vector<Pair> pair_images(const std::vector<Stamp>& lower, const std::vector<Stamp>& upper, Stamp max_skew) {
  std::vector<std::tuple<Stamp, std::size_t, std::size_t>> candidates;
  for (std::size_t i = 0; i < lower.size(); ++i) {
    const auto first = std::lower_bound(upper.begin(), upper.end(), lower[i] - max_skew);
    for (auto u = first; u != upper.end() && *u <= lower[i] + max_skew; ++u) {
      candidates.emplace_back(std::chrono::abs(*u - lower[i]), i, std::size_t(u - upper.begin()));
    }
  }
  std::sort(candidates.begin(), candidates.end());
  std::map<std::size_t, std::size_t> chosen;
  for (const auto& [skew, l, u] : candidates) {
    const auto next = chosen.lower_bound(l);
    const bool after = next == chosen.end() || (next->first != l && next->second > u);
    const bool before = next == chosen.begin() || std::prev(next)->second < u;
    if (after && before) chosen.emplace_hint(next, l, u);
  }
  std::vector<Pair> pairs;
  pairs.reserve(chosen.size());
  for (const auto& [l, u] : chosen) pairs.push_back({l, u});
  return pairs;
}

std::vector<std::uint64_t> lost_before(const std::vector<Stamp>& times, const std::vector<std::size_t>& used) {
  const auto period = median_period(times);
  // Number of exposures, stored or not, up to and including each image.
  std::vector<std::uint64_t> exposures(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    std::uint64_t step = 1;
    if (i > 0) {
      const double periods = to_seconds(times[i] - times[i - 1]) / to_seconds(*period);
      step = std::uint64_t(std::max(1LL, std::llround(periods)));
    }
    exposures[i] = (i > 0 ? exposures[i - 1] : 0) + step;
  }
  std::vector<std::uint64_t> lost;
  for (std::size_t i = 0; i < used.size(); ++i) {
    lost.push_back(exposures[used[i]] - (i > 0 ? exposures[used[i - 1]] : 0) - 1);
  }
  return lost;
}

}  // namespace twocone::importer

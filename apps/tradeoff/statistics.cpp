// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/statistics.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "base/errors.h"

namespace twocone::tradeoff {
namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();
/// Relative rounding error by which a share times a count can exceed a whole number.
constexpr double kRankSlack = 1e-9;

/// Checks the arguments of the function `who` and returns the episodes that have values. @throws std::invalid_argument
ByEpisode checked(const char* who, const ByEpisode& values, double level, bool zero_or_one = false) {
  if (!(level > 0 && level < 1)) {
    throw base::InvalidArgument("{}: level is {}, must lie between 0 and 1", who, level);
  }
  ByEpisode episodes;
  for (std::size_t episode = 0; episode < values.size(); ++episode) {
    for (const double value : values[episode]) {
      if (zero_or_one ? value == 0 || value == 1 : std::isfinite(value) && value >= 0) continue;
      throw base::InvalidArgument("{}: a value of episode {} is {}, must be {}", who, episode, value,
                                  zero_or_one ? "0 or 1" : "finite and >= 0");
    }
    if (!values[episode].empty()) episodes.push_back(values[episode]);
  }
  if (episodes.empty()) throw base::InvalidArgument("{}: there is no value", who);
  return episodes;
}

/// The mean of all values as a ratio of two sums over episodes, with its scatter. The scatter requires kLeastEpisodes.
struct RatioOfSums {
  double mean = 0;
  double standard_error = 0;
  double c = 0;  ///< scaled skewness, as in the header file
  double values = 0;
  std::size_t episodes = 0;

  explicit RatioOfSums(const ByEpisode& by_episode) : episodes(by_episode.size()) {
    std::vector<std::pair<double, double>> sums;
    double sum = 0;
    for (const auto& episode : by_episode) {
      double of_episode = 0;
      for (const double value : episode) of_episode += value;
      sums.emplace_back(of_episode, double(episode.size()));
      sum += of_episode;
      values += double(episode.size());
    }
    mean = sum / values;
    if (episodes < kLeastEpisodes) return;
    const double k = double(episodes);
    double squares = 0, cubes = 0;
    for (const auto& [of_episode, count] : sums) {
      const double z = (of_episode - mean * count) * k / values;
      squares += z * z;
      cubes += z * z * z;
    }
    standard_error = std::sqrt(squares / (k * (k - 1)));
    const double sigma = std::sqrt(squares / k);
    if (sigma > 0) c = cubes * k / ((k - 1) * (k - 2)) / (sigma * sigma * sigma) / std::sqrt(k);
  }

  /// Returns mu for g(T) = g.
  [[nodiscard]] double mean_at(double g) const {
    const double y = c * (g - c / 6);
    // This is (cbrt(1 + y) - 1) / y without a difference of nearly equal numbers.
    const double root = std::cbrt(1 + y);
    const double t = 3 * (g - c / 6) / (root * root + root + 1);
    return mean - standard_error * t;
  }
};

Interval mean_of(const ByEpisode& episodes, double level) {
  const RatioOfSums ratio(episodes);
  if (episodes.size() < kLeastEpisodes) return {ratio.mean, 0, kNoLimit};
  const double t = students_t(double(episodes.size() - 1), (1 + level) / 2);
  return {ratio.mean, std::max(0.0, ratio.mean_at(t)), ratio.mean_at(-t)};
}

std::size_t nearest_rank(double q, double count) {
  return std::size_t(std::max(1.0, std::ceil(q * count - kRankSlack * count)));
}

/// Returns the number of independent trials that is equivalent to the data of a share. If all values are equal, it is
/// the number of episodes.
double effective_trials(const RatioOfSums& share) {
  const double p = share.mean;
  if (!(p > 0 && p < 1)) return double(share.episodes);
  const double binomial = p * (1 - p) / (share.values - 1);
  return share.values / std::max(1.0, share.standard_error * share.standard_error / binomial);
}

}  // namespace

double students_t(double freedom, double probability) {
  return boost::math::quantile(boost::math::students_t(freedom), probability);
}

double normal_quantile(double probability) { return boost::math::quantile(boost::math::normal(), probability); }

Interval mean_interval(const ByEpisode& values, double level) {
  return mean_of(checked("mean_interval", values, level), level);
}

double mean_upper_limit(const ByEpisode& values, double level) {
  const ByEpisode episodes = checked("mean_upper_limit", values, level);
  if (episodes.size() < kLeastEpisodes) return kNoLimit;
  return RatioOfSums(episodes).mean_at(students_t(double(episodes.size() - 1), 1 - level));
}

Interval rmse_interval(const ByEpisode& values, double level) {
  ByEpisode squares = checked("rmse_interval", values, level);
  for (auto& episode : squares) {
    for (double& value : episode) value *= value;
  }
  const Interval mean = mean_of(squares, level);
  return {std::sqrt(mean.value), std::sqrt(mean.low), std::sqrt(mean.high)};
}

Interval quantile_interval(const ByEpisode& values, double q, double level) {
  if (!(q > 0 && q <= 1)) {
    throw base::InvalidArgument("quantile_interval: q is {}, must be > 0 and <= 1", q);
  }
  const ByEpisode episodes = checked("quantile_interval", values, level);
  std::vector<double> sorted;
  for (const auto& episode : episodes) sorted.insert(sorted.end(), episode.begin(), episode.end());
  std::sort(sorted.begin(), sorted.end());
  const double count = double(sorted.size());
  const double value = sorted[nearest_rank(q, count) - 1];
  if (episodes.size() < kLeastEpisodes) return {value, 0, kNoLimit};

  ByEpisode is_up_to = episodes;
  for (auto& episode : is_up_to) {
    for (double& x : episode) x = x <= value ? 1 : 0;
  }
  const double half = students_t(double(episodes.size() - 1), (1 + level) / 2) *
                      std::sqrt(q * (1 - q) / effective_trials(RatioOfSums(is_up_to)));
  const double low = std::max(1.0, std::floor((q - half) * count));
  const double high = std::min(count, std::ceil((q + half) * count) + 1);
  return {value, sorted[std::size_t(low) - 1], sorted[std::size_t(high) - 1]};
}

Interval share_interval(const ByEpisode& zero_or_one, double level) {
  const ByEpisode episodes = checked("share_interval", zero_or_one, level, true);
  const RatioOfSums ratio(episodes);
  const double p = ratio.mean;
  if (episodes.size() < kLeastEpisodes) return {p, 0, 1};
  const double trials = effective_trials(ratio);
  const double z = normal_quantile((1 + level) / 2);
  const double shrink = 1 + z * z / trials;
  const double centre = (p + z * z / (2 * trials)) / shrink;
  const double half = z / shrink * std::sqrt(p * (1 - p) / trials + z * z / (4 * trials * trials));
  return {p, std::clamp(centre - half, 0.0, p), std::clamp(centre + half, p, 1.0)};
}

}  // namespace twocone::tradeoff

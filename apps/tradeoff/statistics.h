// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace twocone::tradeoff {

/// A number and its confidence interval.
struct Interval {
  double value = 0;
  double low = 0, high = 0;
};

/// Return the quantile of Student's t with `freedom` degrees of freedom, and that of the standard normal distribution.
double students_t(double freedom, double probability);
double normal_quantile(double probability);

/// Errors or times by episode. Each value is finite and >= 0. Episodes are independent; frames of one episode are not,
/// because they are near each other. Episodes may have different numbers of values, or none. Every interval below is
/// over the episodes that have values. With fewer than kLeastEpisodes of these it extends from 0 to infinity (for a
/// share, to 1).
///
/// All functions here depend on their arguments only.
/// @throws std::invalid_argument (all functions below) if there is no value, for a value outside its domain (the
/// message names it), and for a level that is not between 0 and 1
using ByEpisode = std::vector<std::vector<double>>;
constexpr std::size_t kLeastEpisodes = 3;

/// Returns the mean of all values, with its interval by Hall's transformation of Student's t (Hall, "On the removal of
/// skewness by transformation", JRSS B 54, 1992). The transformation is used because errors are skewed: the upper end
/// of the usual interval is then too low.
///
/// The mean m is a ratio estimator, sum(s_i) / sum(n_i) over k episodes of n_i values with sum s_i; z_i = (s_i - m n_i)
/// / mean(n_i). With T = (m - mu) / se, se^2 = sum(z_i^2) / (k (k - 1)), and c the skewness of z (its unbiased third
/// moment over sigma^3) divided by sqrt(k), the distribution of
///
///     g(T) = T + c T^2 / 3 + c^2 T^3 / 27 + c / 6        T = 3 / c (cbrt(1 + c (g - c / 6)) - 1)
///
/// is nearly Student's with k - 1 degrees of freedom.
///
/// Measured for a hard case (lognormal episodes, sigma of the logarithm 1, skewness 6;
/// tests/tradeoff/statistics_test.cpp): 95 % intervals contain the mean in 91, 92 and 92 % of cases for 8, 16 and 24
/// episodes (Student's own: 83, 85 and 87 %). Upper limits of 99.93 % are above it in 97.9, 99.0 and 99.3 % (95.4, 95.7
/// and 96.3 %), and are 3.5 times the mean at 24 episodes. At sigma 0.5 and 24 episodes: 94 and 99.6 %, 2.0 times the
/// mean.
/// @param level two-sided, e.g. 0.95
Interval mean_interval(const ByEpisode& values, double level);
/// Returns the one-sided upper limit of the mean at `level`, e.g. 1 - 0.05 / 70.
double mean_upper_limit(const ByEpisode& values, double level);
/// Returns the root mean square, from the mean of squares.
Interval rmse_interval(const ByEpisode& values, double level);
/// Returns a quantile (nearest rank, 0 < q <= 1) with its interval from order statistics (Woodruff, "Confidence
/// intervals for medians and other position measures", JASA 47, 1952): the values of ranks q +- t sqrt(q (1 - q) /
/// trials). The trials are those of share_interval for the share of values up to the quantile, and t is Student's with
/// episodes - 1 degrees of freedom. If the upper rank exceeds the number of values, the interval ends at the last
/// value, so with few episodes the upper end of a high quantile is too low. At 0.95, with lognormal episodes of sigma
/// 0.5 and up to 4 values, it is above the quantile in 65, 95 and 99 % of cases for 8, 24 and 40 episodes, not 97.5 %.
/// Intervals of the median contain it in 97 % for 24 episodes (statistics_test.cpp).
Interval quantile_interval(const ByEpisode& values, double q, double level);
/// Returns the share of ones, with Wilson's interval and the number of trials divided by the episodes' design effect:
/// the variance of the ratio estimator over the binomial one, at least 1. If all values are equal, the data do not
/// determine it, and each episode counts as one trial. The interval contains a share of 0.95 in 96 % of cases for 8 and
/// for 24 episodes (statistics_test.cpp).
Interval share_interval(const ByEpisode& zero_or_one, double level);

}  // namespace twocone::tradeoff

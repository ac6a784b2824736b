// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace twocone::tradeoff {

/// A number and its confidence interval.
struct Interval {
  double value = 0;
  double low = 0, high = 0;
};

/// Errors (or times) by leg: each value finite and >= 0. Frames of one leg are near each other and not independent;
/// legs are. Every interval below is over the legs that have values; legs may have different numbers of them, or none.
/// Of fewer than kLeastLegs such legs an interval goes from 0 to infinity (of a share: to 1).
///
/// All functions here are functions of their arguments alone.
/// @throws std::invalid_argument (all of them) for no value at all, a value out of its domain (says which), and a level
/// that does not lie between 0 and 1
using ByLeg = std::vector<std::vector<double>>;
constexpr std::size_t kLeastLegs = 3;

/// Mean of all values, and its interval by Hall's transformation of Student's t (Hall, "On the removal of skewness by
/// transformation", JRSS B 54, 1992), which errors need: they are skewed, and the usual interval then ends too low.
///
/// The mean m is a ratio estimator, sum(s_i) / sum(n_i) over legs of n_i values with sum s_i; k legs, and
/// z_i = (s_i - m n_i) / mean(n_i). With T = (m - mu) / se, se^2 = sum(z_i^2) / (k (k - 1)), and c the skewness of z
/// (its unbiased third moment over sigma^3) divided by sqrt(k), the distribution of
///
///     g(T) = T + c T^2 / 3 + c^2 T^3 / 27 + c / 6        T = 3 / c (cbrt(1 + c (g - c / 6)) - 1)
///
/// is nearly Student's with k - 1 degrees of freedom.
///
/// Measured where it is hard (lognormal legs, sigma of the logarithm 1, skewness 6; tests/tradeoff/coverage_test.cpp):
/// intervals of 95 % hold the mean in 91, 92 and 92 % of cases for 8, 16 and 24 legs (Student's own: 83, 85 and 87 %);
/// upper limits of 99.93 % in 97.9, 99.0 and 99.3 % (95.4, 95.7 and 96.3 %), and are 3.5 times the mean at 24 legs. At
/// sigma 0.5 and 24 legs: 94 and 99.6 %, 2.0 times the mean.
/// @param level two-sided, e.g. 0.95
Interval mean_interval(const ByLeg& values, double level);
/// One-sided upper limit of the mean at `level`, e.g. 1 - 0.05 / 70.
double mean_upper_limit(const ByLeg& values, double level);
/// Root mean square, by the mean of squares.
Interval rmse_interval(const ByLeg& values, double level);
/// Quantile (nearest rank, 0 < q <= 1), interval from order statistics (Woodruff, "Confidence intervals for medians and
/// other position measures", JASA 47, 1952): the values of ranks q +- t sqrt(q (1 - q) / trials), trials as of
/// share_interval for the share of values up to the quantile, t of Student with legs - 1 degrees of freedom. Where the
/// upper rank passes the last value the interval ends there, so of few legs the end of a high quantile comes too low:
/// at 0.95, lognormal legs of sigma 0.5 and up to 4 values, it lies above the quantile in 65, 95 and 99 % of cases for
/// 8, 24 and 40 legs instead of 97.5 %. Intervals of the median hold it in 97 % for 24 legs (coverage_test.cpp).
Interval quantile_interval(const ByLeg& values, double q, double level);
/// Share of ones, interval by Wilson with the number of trials divided by the legs' design effect: the variance of the
/// ratio estimator over the binomial one, at least 1. Where all values are equal nothing tells it; each leg then counts
/// as one trial. Holds a share of 0.95 in 96 % of cases for 8 and for 24 legs (coverage_test.cpp).
Interval share_interval(const ByLeg& zero_or_one, double level);

}  // namespace twocone::tradeoff

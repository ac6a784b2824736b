// SPDX-License-Identifier: Apache-2.0
// Measures how often the intervals contain the true value, for values as hard as a sweep's: few episodes, skewed,
// correlated within an episode. apps/tradeoff/statistics.h states the shares that are measured here; each limit is one
// of them, rounded down, minus three standard deviations of this number of trials.
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "apps/tradeoff/statistics.h"

namespace twocone::tradeoff {
namespace {

constexpr double kOneSided = 1 - 0.05 / 70;
constexpr double kWithin = 0.4;  ///< sigma of the logarithm of an episode's own scatter, whose mean is 1

/// Returns two to four values for each episode about the episode's own mean, which is lognormal with sigma `between` of
/// its logarithm.
ByEpisode draw(std::mt19937_64& engine, int episodes, double between) {
  std::normal_distribution<double> normal;
  ByEpisode values(static_cast<std::size_t>(episodes));
  for (auto& episode : values) {
    const double mean = std::exp(between * normal(engine));
    const std::size_t lost = engine() % 6;  // frames without an answer: 2 of 4 in one episode of six, 1 in another
    const std::size_t count = lost == 0 ? 2 : lost == 1 ? 3 : 4;
    for (std::size_t i = 0; i < count; ++i) {
      episode.push_back(mean * std::exp(kWithin * normal(engine) - kWithin * kWithin / 2));
    }
  }
  return values;
}

double three_sigma(double share, int trials) { return 3 * std::sqrt(share * (1 - share) / trials); }

struct Case {
  int episodes;
  double between;
  double two_sided, one_sided;          ///< smallest share, of many trials
  double students, students_one_sided;  ///< largest share of the usual interval, which shows why another one is needed
  double limit;                         ///< mean upper limit over the mean
};
/// A limit scatters by about its own size, and its mean over 3000 trials by 2 %. The tolerance is three such deviations
/// and the rounding.
constexpr double kLimit = 0.1;

struct MeanWithError {
  double mean, standard_error;
};
MeanWithError usual(const ByEpisode& values) {
  double sum = 0, count = 0, squares = 0;
  for (const auto& episode : values) {
    for (const double x : episode) sum += x;
    count += double(episode.size());
  }
  for (const auto& episode : values) {
    double residual = 0;
    for (const double x : episode) residual += x - sum / count;
    squares += residual * residual;
  }
  const double k = double(values.size());
  return {sum / count, std::sqrt(squares * k / (k - 1)) / count};
}
void PrintTo(const Case& c, std::ostream* os) { *os << c.episodes << " episodes, sigma " << c.between; }

class MeanCoverage : public ::testing::TestWithParam<Case> {};

TEST_P(MeanCoverage, IsAsStated) {
  constexpr int kTrials = 3000;
  const auto [episodes, between, two_sided, one_sided, students, students_one_sided, limit] = GetParam();
  const boost::math::students_t t(episodes - 1);
  const double t_two = quantile(t, 0.975), t_one = quantile(t, kOneSided);
  const double truth = std::exp(between * between / 2);
  std::mt19937_64 engine(2006);
  int held = 0, below = 0, usual_held = 0, usual_below = 0;
  double limits = 0;
  for (int i = 0; i < kTrials; ++i) {
    const ByEpisode values = draw(engine, episodes, between);
    const Interval interval = mean_interval(values, 0.95);
    held += interval.low <= truth && truth <= interval.high;
    const double upper = mean_upper_limit(values, kOneSided);
    below += truth <= upper;
    limits += upper / truth / kTrials;
    const auto [mean, standard_error] = usual(values);
    usual_held += std::abs(mean - truth) <= t_two * standard_error;
    usual_below += truth <= mean + t_one * standard_error;
  }
  const double held_share = double(held) / kTrials, below_share = double(below) / kTrials;
  fmt::print(
      "{:2} episodes, sigma {}: 95 % interval {:.4f}, upper limit 1 - 0.05/70 {:.4f}, {:.2f} times the mean; Student's "
      "{:.4f}, {:.4f}\n",
      episodes, between, held_share, below_share, limits, double(usual_held) / kTrials, double(usual_below) / kTrials);
  EXPECT_GE(held_share, two_sided - three_sigma(two_sided, kTrials));
  EXPECT_GE(below_share, one_sided - three_sigma(one_sided, kTrials));
  EXPECT_LE(double(usual_held) / kTrials, students + three_sigma(students, kTrials));
  EXPECT_LE(double(usual_below) / kTrials, students_one_sided + three_sigma(students_one_sided, kTrials));
  EXPECT_LE(limits, limit * (1 + kLimit));
  // The interval is not wider than 95 % requires.
  EXPECT_LE(held_share, 0.95 + three_sigma(0.95, kTrials));
}

INSTANTIATE_TEST_SUITE_P(Lognormal, MeanCoverage,
                         ::testing::Values(Case{8, 1.0, 0.908, 0.978, 0.83, 0.955, 5},
                                           Case{16, 1.0, 0.92, 0.989, 0.855, 0.958, 4},
                                           Case{24, 1.0, 0.92, 0.992, 0.87, 0.964, 3.5},
                                           Case{24, 0.5, 0.936, 0.996, 0.93, 0.992, 2}));

TEST(QuantileCoverage, IsAsStated) {
  constexpr int kTrials = 1500;
  constexpr double kBetween = 0.5;
  const double sigma = std::hypot(kBetween, kWithin);
  struct Level {
    double q, normal_quantile;
    int episodes;
    double least_share, least_below;
  };
  for (const auto& [q, z, episodes, least_share, least_below] :
       {Level{0.5, 0, 24, 0.96, 0.98}, Level{0.95, 1.644853627, 8, 0.62, 0.64},
        Level{0.95, 1.644853627, 24, 0.92, 0.95}, Level{0.95, 1.644853627, 40, 0.96, 0.99}}) {
    const double truth = std::exp(-kWithin * kWithin / 2 + z * sigma);
    std::mt19937_64 engine(2005);
    int held = 0, below = 0;
    for (int i = 0; i < kTrials; ++i) {
      const Interval interval = quantile_interval(draw(engine, episodes, kBetween), q, 0.95);
      held += interval.low <= truth && truth <= interval.high;
      below += truth <= interval.high;
    }
    const double held_share = double(held) / kTrials, below_share = double(below) / kTrials;
    fmt::print("{:2} episodes, quantile {}: 95 % interval {:.3f}, upper end {:.3f}\n", episodes, q, held_share,
               below_share);
    EXPECT_GE(held_share, least_share - three_sigma(least_share, kTrials))
        << "q " << q << ", " << episodes << " episodes";
    EXPECT_GE(below_share, least_below - three_sigma(least_below, kTrials))
        << "q " << q << ", " << episodes << " episodes";
  }
}

/// A fifth of the episodes have a share of 0.75, the others of 1: 0.95 in all.
TEST(ShareCoverage, IsAsStated) {
  constexpr int kTrials = 4000;
  for (const auto& [episodes, least_share] : {std::pair{8, 0.96}, {24, 0.96}}) {
    std::mt19937_64 engine(1998);
    int held = 0;
    for (int i = 0; i < kTrials; ++i) {
      ByEpisode values(static_cast<std::size_t>(episodes));
      for (auto& episode : values) {
        const bool is_hard = engine() % 5 == 0;
        for (int k = 0; k < 4; ++k) episode.push_back(is_hard && engine() % 4 == 0 ? 0 : 1);
      }
      const Interval interval = share_interval(values, 0.95);
      held += interval.low <= 0.95 && 0.95 <= interval.high;
    }
    const double held_share = double(held) / kTrials;
    fmt::print("{:2} episodes, share 0.95: 95 % interval {:.4f}\n", episodes, held_share);
    EXPECT_GE(held_share, least_share - three_sigma(least_share, kTrials)) << episodes << " episodes";
  }
}

}  // namespace
}  // namespace twocone::tradeoff

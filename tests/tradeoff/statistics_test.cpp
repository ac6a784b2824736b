// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/statistics.h"

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <random>
#include <stdexcept>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/special_doubles.h"

namespace twocone::tradeoff {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using twocone::testing_support::kInf;
using twocone::testing_support::kNaN;

/// Numbers computed by hand have 9 digits.
constexpr double kHandDigits = 1e-8;
/// Student's t with 2 degrees of freedom at 0.975: sqrt(2) 0.95 / sqrt(1 - 0.95^2) in closed form.
const double kT2 = std::sqrt(2.0) * 0.95 / std::sqrt(1 - 0.95 * 0.95);

/// Sums of 4, 4 and 18 over 2, 1 and 3 values: mean 26/6; z = -14/6, -1/6, 15/6.
const ByEpisode kUnequal{{1, 3}, {4}, {5, 6, 7}};
const ByEpisode kSkewed{{0.31}, {0.28}, {0.33, 0.29}, {0.35}, {2.9, 3.1}, {0.4}, {0.27, 0.31}, {0.9}};

TEST(MeanInterval, WithoutSkewnessIsStudents) {
  const Interval i = mean_interval({{11}, {12}, {13}}, 0.95);
  const double half = kT2 * std::sqrt(1.0 / 3);
  EXPECT_NEAR(i.value, 12, kHandDigits);
  EXPECT_NEAR(i.low, 12 - half, kHandDigits);
  EXPECT_NEAR(i.high, 12 + half, kHandDigits);
}

TEST(MeanInterval, IsHallsOfTheRatioEstimatorForUnequalEpisodes) {
  const double z[3] = {-14 / 6.0, -1 / 6.0, 15 / 6.0};
  double squares = 0, cubes = 0;
  for (const double x : z) {
    squares += x * x;
    cubes += x * x * x;
  }
  const double se = std::sqrt(squares / 6), c = cubes * 3 / 2 / std::pow(squares / 3, 1.5) / std::sqrt(3.0);
  const auto g = [c](double t) { return t + c * t * t / 3 + c * c * t * t * t / 27 + c / 6; };
  const Interval i = mean_interval(kUnequal, 0.95);
  EXPECT_NEAR(i.value, 26 / 6.0, kHandDigits);
  // Clipped: Hall's own lower end lies below 0.
  EXPECT_GT(g((26 / 6.0) / se), -kT2);
  EXPECT_NEAR(g((i.value - i.high) / se), -kT2, kHandDigits);
  // At a level whose lower end is above 0; Student's t with 2 degrees at 0.75 is sqrt(2) 0.5 / sqrt(1 - 0.5^2).
  const Interval half = mean_interval(kUnequal, 0.5);
  EXPECT_NEAR(g((half.value - half.low) / se), std::sqrt(2.0) * 0.5 / std::sqrt(0.75), kHandDigits);
}

TEST(MeanInterval, OfSkewedErrorsExtendsFurtherUp) {
  const Interval i = mean_interval(kSkewed, 0.95);
  EXPECT_GT(i.high - i.value, 2 * (i.value - i.low)) << i.low << " " << i.value << " " << i.high;
  EXPECT_GE(i.low, 0);
}

TEST(MeanInterval, GrowsWithTheValuesAndIgnoresEmptyEpisodes) {
  ByEpisode more = kSkewed;
  for (auto& episode : more) {
    for (double& x : episode) x *= 8;
  }
  more.insert(more.begin() + 2, std::vector<double>{});
  const Interval a = mean_interval(kSkewed, 0.95), b = mean_interval(more, 0.95);
  EXPECT_DOUBLE_EQ(8 * a.low, b.low);
  EXPECT_DOUBLE_EQ(8 * a.value, b.value);
  EXPECT_DOUBLE_EQ(8 * a.high, b.high);
}

TEST(MeanInterval, OfEqualValuesIsThatValue) {
  const Interval i = mean_interval({{0.25, 0.25}, {0.25}, {0.25, 0.25, 0.25}}, 0.95);
  EXPECT_EQ(i.low, 0.25);
  EXPECT_EQ(i.value, 0.25);
  EXPECT_EQ(i.high, 0.25);
}

TEST(MeanInterval, OfFewEpisodesIsOpen) {
  for (const ByEpisode& few : {ByEpisode{{1, 2, 6}}, ByEpisode{{1, 2}, {}, {6}}}) {
    for (const Interval& i : {mean_interval(few, 0.95), quantile_interval(few, 0.5, 0.95), rmse_interval(few, 0.95)}) {
      EXPECT_EQ(i.low, 0);
      EXPECT_EQ(i.high, kInf);
    }
    EXPECT_EQ(mean_interval(few, 0.95).value, 3);
    EXPECT_EQ(mean_upper_limit(few, 0.95), kInf);
  }
  const Interval share = share_interval({{1, 0}, {1, 1}}, 0.95);
  EXPECT_EQ(share.value, 0.75);
  EXPECT_EQ(share.low, 0);
  EXPECT_EQ(share.high, 1);
}

TEST(MeanUpperLimit, IsTheUpperEndOfTheIntervalOfTwiceTheRisk) {
  EXPECT_DOUBLE_EQ(mean_upper_limit(kSkewed, 0.975), mean_interval(kSkewed, 0.95).high);
  EXPECT_LT(mean_upper_limit(kSkewed, 0.975), mean_upper_limit(kSkewed, 1 - 0.05 / 70));
}

TEST(RmseInterval, IsTheRootOfTheMeanOfSquares) {
  const Interval rmse = rmse_interval({{3, 3}, {4}, {5}}, 0.95), squares = mean_interval({{9, 9}, {16}, {25}}, 0.95);
  EXPECT_NEAR(rmse.value, std::sqrt(59 / 4.0), kHandDigits);
  EXPECT_NEAR(rmse.low * rmse.low, squares.low, kHandDigits);
  EXPECT_NEAR(rmse.high * rmse.high, squares.high, 1e-6);  // the interval is wide: about 80
}

TEST(QuantileInterval, IsTheNearestRank) {
  ByEpisode episodes(5);
  for (int i = 1; i <= 20; ++i) episodes[std::size_t(i % 5)].push_back(i);
  for (const auto& [q, expected] :
       {std::pair{0.95, 19.0}, {0.951, 20.0}, {0.5, 10.0}, {1.0, 20.0}, {0.05, 1.0}, {0.001, 1.0}}) {
    EXPECT_EQ(quantile_interval(episodes, q, 0.95).value, expected) << "q " << q;
  }
}

/// 40 values in 10 episodes, 1 to 40 distributed in turns: the share up to 20 is 0.5 in each episode, so the design
/// effect is 1 and the half-width is t(9) sqrt(0.25 / 40) = 2.262157 * 0.0790569 = 0.178839, in ranks 7.15: from 12 to
/// 28 + 1.
TEST(QuantileInterval, OfEpisodesThatAreAlikeCountsValues) {
  ByEpisode episodes(10);
  for (int i = 0; i < 40; ++i) episodes[std::size_t(i % 10)].push_back(i + 1);
  const Interval i = quantile_interval(episodes, 0.5, 0.95);
  EXPECT_EQ(i.low, 12);
  EXPECT_EQ(i.value, 20);
  EXPECT_EQ(i.high, 29);
}

/// The same values, sorted into the episodes: 5 episodes are up to 20, 5 above. The share's variance is
/// 10/9 * 10 * 2^2 / 40^2 = 1/36, its binomial one 0.25 / 39; so there are 40 * 36 * 0.25 / 39 = 9.2308 trials, and the
/// half-width is 2.262157 sqrt(0.25 / 9.2308) = 0.372287, in ranks 14.9: from 5 to 35 + 1.
TEST(QuantileInterval, OfEpisodesWithEqualValuesCountsEpisodes) {
  ByEpisode episodes(10);
  for (int i = 0; i < 40; ++i) episodes[std::size_t(i / 4)].push_back(i + 1);
  const Interval i = quantile_interval(episodes, 0.5, 0.95);
  EXPECT_EQ(i.low, 5);
  EXPECT_EQ(i.value, 20);
  EXPECT_EQ(i.high, 36);
}

TEST(QuantileInterval, EndsAtTheLastValue) {
  const ByEpisode episodes{{4, 1}, {2, 2}, {3, 1}, {9, 1}};
  for (const double q : {0.9, 1.0}) EXPECT_EQ(quantile_interval(episodes, q, 0.95).high, 9) << "q " << q;
  const Interval equal = quantile_interval(ByEpisode(4, {0.5, 0.5}), 0.95, 0.95);
  EXPECT_EQ(equal.low, 0.5);
  EXPECT_EQ(equal.high, 0.5);
}

TEST(ShareInterval, OfSingleTrialsIsWilsons) {
  // 8 of 10, as in tables of Wilson's interval: 0.4902 to 0.9433.
  constexpr double kTable = 5e-5;
  ByEpisode episodes(10, {1});
  episodes[3] = episodes[7] = {0};
  const Interval i = share_interval(episodes, 0.95);
  EXPECT_DOUBLE_EQ(i.value, 0.8);
  EXPECT_NEAR(i.low, 0.4902, kTable);
  EXPECT_NEAR(i.high, 0.9433, kTable);
}

TEST(ShareInterval, CountsEpisodesWhereAnEpisodesValuesAgree) {
  ByEpisode agreeing(10, {1, 1, 1, 1}), mixed(10, {1, 1, 1, 1});
  agreeing[3] = agreeing[7] = {0, 0, 0, 0};
  for (std::size_t episode : {0, 1, 2, 3, 4, 5, 6, 7}) mixed[episode][episode % 4] = 0;
  const Interval wide = share_interval(agreeing, 0.95), narrow = share_interval(mixed, 0.95);
  EXPECT_EQ(wide.value, narrow.value);
  // Ten trials instead of forty give nearly twice the width.
  EXPECT_GT(wide.high - wide.low, 1.8 * (narrow.high - narrow.low));
  // The design effect is at least 1: episodes that are more alike than by chance do not narrow the interval.
  constexpr double kZ = 1.959963985, kTrials = 40, kShare = 0.8;
  const double half =
      kZ / (1 + kZ * kZ / kTrials) * std::sqrt(kShare * (1 - kShare) / kTrials + kZ * kZ / (4 * kTrials * kTrials));
  EXPECT_NEAR(narrow.high - narrow.low, 2 * half, kHandDigits);
}

TEST(ShareInterval, OfAllOnesCountsEpisodes) {
  const Interval i = share_interval(ByEpisode(10, {1, 1, 1, 1}), 0.95);
  constexpr double kZ = 1.959963985;
  EXPECT_EQ(i.value, 1);
  EXPECT_NEAR(i.low, 1 / (1 + kZ * kZ / 10), kHandDigits);
  EXPECT_EQ(i.high, 1);
  const Interval none = share_interval(ByEpisode(10, {0, 0}), 0.95);
  EXPECT_EQ(none.low, 0);
  EXPECT_NEAR(none.high, 1 - i.low, kHandDigits);
}

TEST(Statistics, RejectInvalidErrorsAndTimes) {
  const auto message = [](const char* text) { return ThrowsMessage<std::invalid_argument>(HasSubstr(text)); };
  for (const double bad : {kNaN, kInf, -0.5}) {
    const ByEpisode values{{1, 2}, {3}, {4, bad}};
    EXPECT_THAT([&] { mean_interval(values, 0.95); }, message("mean_interval: a value of episode 2 is"));
    EXPECT_THAT([&] { mean_upper_limit(values, 0.95); }, message("must be finite and >= 0"));
    EXPECT_THAT([&] { rmse_interval(values, 0.95); }, message("rmse_interval: a value of episode 2 is"));
    EXPECT_THAT([&] { quantile_interval(values, 0.5, 0.95); }, message("quantile_interval: a value of episode 2 is"));
  }
  EXPECT_THAT([] { share_interval({{1, 0.5}, {1}, {0}}, 0.95); }, message("episode 0 is 0.5, must be 0 or 1"));
  for (const ByEpisode& empty : {ByEpisode{}, ByEpisode{{}, {}, {}}}) {
    EXPECT_THAT([&] { mean_interval(empty, 0.95); }, message("there is no value"));
    EXPECT_THAT([&] { mean_upper_limit(empty, 0.95); }, message("there is no value"));
    EXPECT_THAT([&] { rmse_interval(empty, 0.95); }, message("there is no value"));
    EXPECT_THAT([&] { quantile_interval(empty, 0.5, 0.95); }, message("there is no value"));
    EXPECT_THAT([&] { share_interval(empty, 0.95); }, message("there is no value"));
  }
  for (const double level : {0.0, 1.0, -1.0, kNaN}) {
    EXPECT_THAT([&] { mean_interval(kUnequal, level); }, message("must lie between 0 and 1"));
  }
  for (const double q : {0.0, 1.1, kNaN}) {
    EXPECT_THAT([&] { quantile_interval(kUnequal, q, 0.95); }, message("must be > 0 and <= 1"));
  }
}

// ---- coverage
//
// Measures how often the intervals contain the true value, for values as hard as a sweep's: few episodes, skewed,
// correlated within an episode. apps/tradeoff/statistics.h states the shares that are measured here; each limit is one
// of them, rounded down, minus three standard deviations of this number of trials.

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

// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/wording.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tradeoff/a_sweep.h"

namespace twocone::tradeoff {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

Setting with_antialias(int rays) {
  Setting s = usual_setting();
  s.images.antialias = rays;
  return s;
}
Setting with_size(int width_px) {
  Setting s = usual_setting();
  s.images.width_px = width_px;
  s.images.height_px = width_px * 3 / 4;
  return s;
}
Setting with_level(Level level, double enough_m = 0) {
  Setting s = usual_setting();
  s.level = level;
  s.enough_m = enough_m;
  return s;
}
Setting with_effects(Effects effects) {
  Setting s = usual_setting();
  s.images.effects = effects;
  return s;
}
std::string from_to(const Setting& from, const Setting& to, Axis axis) {
  return fmt::format("from {} to {} ", facts_of(axis).value(from), facts_of(axis).value(to));
}

/// Returns the sentence of an axis; empty without one.
std::string sentence(const std::vector<SettingResult>& settings, Axis axis) {
  Sweep sweep;
  sweep.settings = settings;
  return conclusions(sweep)[axis];
}

TEST(Conclusions, StateTheEffectAndTheCostOfSizeAndAntialiasing) {
  // Errors: 0.38 times for each doubling of the size, 0.41 times for +R2, nothing for +R3; rendering: 4 and 2 times.
  std::vector<SettingResult> all;
  for (const int width : {640, 320, 160}) {
    for (const int rays : {1, 2, 3}) {
      const double doublings = std::log2(width / 160.0);
      Setting s = with_size(width);
      s.images.antialias = rays;
      const double scatter = 1 + 0.003 * std::sin(width + 7.0 * rays);
      all.push_back(result_of(s, 0.02 * std::pow(0.38, doublings) * (rays > 1 ? 0.41 : 1) * scatter, 1e-9,
                              std::pow(4, doublings) * std::pow(2, rays)));
    }
  }
  const std::string size = sentence(all, Axis::kSize);
  EXPECT_THAT(size, StartsWith("image size: " + from_to(with_size(160), with_size(320), Axis::kSize) +
                               "the error falls to 0.38 times (0.3"));
  EXPECT_THAT(size,
              HasSubstr(", 3 pairs) at 4.0 times the simulation time; " +
                        from_to(with_size(320), with_size(640), Axis::kSize) + "the error falls to 0.38 times ("));
  const std::string antialias = sentence(all, Axis::kAntialias);
  EXPECT_THAT(antialias,
              StartsWith("anti-aliasing: " + from_to(with_antialias(1), with_antialias(2), Axis::kAntialias) +
                         "the error falls to 0.41 times (0."));
  EXPECT_THAT(antialias,
              HasSubstr(fmt::format("; beyond {} no gain in accuracy was found: ",
                                    facts_of(Axis::kAntialias).value(with_antialias(2))) +
                        from_to(with_antialias(2), with_antialias(3), Axis::kAntialias) + "the error is 1.0"));
  EXPECT_THAT(antialias, EndsWith(", 3 pairs) at 2.0 times the simulation time"));
  // Every other axis has one value.
  EXPECT_EQ(sentence(all, Axis::kLevel), "");
  Sweep sweep;
  sweep.settings = all;
  EXPECT_EQ(conclusions(sweep).size(), 2u);
}

TEST(Conclusions, AreEmptyWithoutSettings) { EXPECT_TRUE(conclusions(Sweep{}).empty()); }

/// With one pair, the half-width of the log-ratio is sqrt(2) log(1.05), so exp(0.069) = 1.0714 to either side.
TEST(Conclusions, OfOnePairUseItsOwnIntervals) {
  EXPECT_THAT(sentence({result_of(with_antialias(1), 0.010, 1, 1), result_of(with_antialias(2), 0.005, 1, 2)},
                       Axis::kAntialias),
              HasSubstr("the error falls to 0.50 times (0.47 to 0.54, 1 pair) at 1.5 times the simulation time"));
}

/// With two pairs of ratios 0.5 and 0.6: t(1) = 12.706, sd / sqrt(2) = log(1.2) / 2: exp(+-1.158) about 0.5477.
TEST(Conclusions, OfPairsThatDisagreeUseTheirScatter) {
  Setting a = with_antialias(1), b = with_antialias(2);
  std::vector<SettingResult> all{result_of(a, 0.010, 1, 1), result_of(b, 0.005, 1, 2)};
  a.landmarks = b.landmarks = 4;
  all.push_back(result_of(a, 0.010, 1, 1));
  all.push_back(result_of(b, 0.006, 1, 2));
  EXPECT_THAT(sentence(all, Axis::kAntialias),
              HasSubstr("no effect on the error was found, but the data do not exclude one (factor 0.55, 0.17 to "
                        "1.74, 2 pairs) at 1.5 times the simulation time"));
}

TEST(Conclusions, DistinguishLossFromSaving) {
  const auto fine = result_of(with_level(Level::kFine), 0.010, 0.020, 1);
  const auto to_adaptive = [&](double error_m, double time_s) {
    return sentence({fine, result_of(with_level(Level::kAdaptive, 0.005), error_m, time_s, 1)}, Axis::kLevel);
  };
  EXPECT_THAT(to_adaptive(0.0102, 0.008),
              HasSubstr("no effect on the error was found (factor 1.02, 0.95 to 1.09, 1 pair) at 0.40 times the "
                        "robot time"));
  EXPECT_THAT(to_adaptive(0.0102, 0.020), HasSubstr("no effect on the error was found (factor 1.02, "));
  EXPECT_THAT(to_adaptive(0.013, 0.008), HasSubstr("the error rises to 1.30 times"));
  EXPECT_THAT(to_adaptive(0.007, 0.090),
              HasSubstr("the error falls to 0.70 times (0.65 to 0.75, 1 pair) at 4.5 times"));
}

TEST(Conclusions, ComparesAdaptiveWithFineAndEffectsWithTheScenes) {
  const std::string level =
      sentence({result_of(with_level(Level::kAdaptive, 0.002), 0.003, 1, 1),
                result_of(with_level(Level::kAdaptive, 0.005), 0.005, 1, 1),
                result_of(with_level(Level::kFine), 0.002, 1, 1), result_of(with_level(Level::kPaper), 0.03, 1, 1)},
               Axis::kLevel);
  const Setting paper = with_level(Level::kPaper), fine = with_level(Level::kFine),
                two = with_level(Level::kAdaptive, 0.002), five = with_level(Level::kAdaptive, 0.005);
  EXPECT_THAT(level, StartsWith("estimator: " + from_to(paper, fine, Axis::kLevel)));
  EXPECT_THAT(level, HasSubstr("; " + from_to(fine, two, Axis::kLevel) + "the error rises to 1.50"));
  EXPECT_THAT(level, HasSubstr("; " + from_to(fine, five, Axis::kLevel) + "the error rises to 2.50"));
  const std::string effects = sentence(
      {result_of(with_effects(Effects::kNoise), 0.004, 1, 1), result_of(with_effects(Effects::kFlat), 0.001, 1, 1),
       result_of(with_effects(Effects::kScene), 0.002, 1, 1)},
      Axis::kEffects);
  EXPECT_THAT(effects, HasSubstr(from_to(with_effects(Effects::kScene), with_effects(Effects::kFlat), Axis::kEffects) +
                                 "the error falls to 0.50 times"));
  EXPECT_THAT(effects, HasSubstr(from_to(with_effects(Effects::kScene), with_effects(Effects::kNoise), Axis::kEffects) +
                                 "the error rises to 2.00 times"));
}

TEST(Conclusions, LeaveOutSettingsThatSeldomAnswerAndNameThem) {
  std::vector<SettingResult> all{result_of(with_size(160), 0.0001, 1, 1), result_of(with_size(320), 0.010, 1, 4),
                                 result_of(with_size(640), 0.004, 1, 16)};
  all[0].answered = 40;
  const std::string text = sentence(all, Axis::kSize);
  EXPECT_THAT(text, StartsWith("image size: " + from_to(with_size(320), with_size(640), Axis::kSize)));
  EXPECT_THAT(text,
              EndsWith("; " + facts_of(Axis::kSize).value(with_size(160)) + " answers in only 40 % of the frames"));
  EXPECT_EQ(text.find("no gain"), std::string::npos);
  all[1].answered = 0;
  all[1].position_m.reset();
  EXPECT_THAT(sentence(all, Axis::kSize),
              HasSubstr("no two settings that answer often enough differ in this axis only; "));
}

TEST(Conclusions, PairOnlySettingsThatDifferInNothingElse) {
  Setting other = with_antialias(2);
  other.landmarks = 3;
  EXPECT_THAT(sentence({result_of(with_antialias(1), 0.01, 1, 1), result_of(other, 0.001, 1, 1)}, Axis::kAntialias),
              EndsWith("no two settings that answer often enough differ in this axis only"));
  // There is no pair of neighbours, so the step skips the value between them.
  Setting between = with_antialias(2);
  between.landmarks = 3;
  EXPECT_THAT(sentence({result_of(with_antialias(1), 0.01, 1, 1), result_of(between, 0.001, 1, 1),
                        result_of(with_antialias(3), 0.005, 1, 1)},
                       Axis::kAntialias),
              HasSubstr(from_to(with_antialias(1), with_antialias(3), Axis::kAntialias) + "the error falls to 0.50"));
}

TEST(Conclusions, OfTooFewEpisodesStateNoInterval) {
  auto open = result_of(with_antialias(2), 0.005, 1, 1);
  open.position_m->mean = {0.005, 0, std::numeric_limits<double>::infinity()};
  const std::string text = sentence({result_of(with_antialias(1), 0.01, 1, 1), open}, Axis::kAntialias);
  EXPECT_THAT(text, HasSubstr("the measured error is 0.50 times (too few episodes for an interval, 1 pair) at "));
  EXPECT_THAT(text, Not(HasSubstr("inf")));
}

/// Catches a large effect that is reported as none: an interval that excludes 1 is an effect, and a ratio without an
/// interval is stated as measured.
TEST(Conclusions, NeverHideALargeEffect) {
  const auto from_paper = [](SettingResult found) {
    return sentence({result_of(with_level(Level::kPaper), 0.030, 0.002, 1), found}, Axis::kLevel);
  };
  const auto found = result_of(with_level(Level::kFound), 0.030 * 0.034, 0.001, 1);
  EXPECT_THAT(from_paper(found), HasSubstr("the error falls to 0.034 times (0.032 to 0.036, 1 pair) at 0.50 times"));
  auto open = found;
  open.position_m->mean = {0.030 * 0.034, 0, std::numeric_limits<double>::infinity()};
  EXPECT_THAT(from_paper(open),
              HasSubstr("the measured error is 0.034 times (too few episodes for an interval, 1 pair)"));
  EXPECT_THAT(from_paper(open), Not(HasSubstr("no effect")));
  // With an open upper end, a rise is still a rise.
  auto worse = result_of(with_level(Level::kFound), 0.090, 0.001, 1);
  worse.position_m->mean.high = std::numeric_limits<double>::infinity();
  EXPECT_THAT(from_paper(worse), HasSubstr("the error rises to 3.00 times (at least 2.80, 1 pair) at 0.50 times"));
}

// ---- growth

const Growth* find(const std::vector<Growth>& all, Axis axis, const std::string& of) {
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Growth& g) { return g.axis == axis && g.of == of; });
  return found == all.end() ? nullptr : &*found;
}

TEST(Growth, IsTheExponentThatWasPlanted) {
  constexpr double kDigits = 1e-9;
  Sweep sweep;
  for (const double factor : {1.0, 3.7}) {  // two groups, each with its own factor
    for (const int width : {160, 320, 480, 640}) {
      Setting s = with_size(width);
      s.landmarks = factor > 1 ? 4 : 6;
      const double pixels = double(s.images.width_px) * s.images.height_px;
      sweep.settings.push_back(result_of(s, factor * std::pow(pixels, -0.61), factor * std::pow(pixels, 0.83),
                                         1e-6 * std::pow(pixels, 1.07), factor > 1 ? 9 : 4));
    }
  }
  for (const int frames : {2, 4, 8}) {
    Setting s = usual_setting();
    s.frames = frames;
    s.rate_hz = 5;
    sweep.settings.push_back(result_of(s, 0.01 * std::pow(frames, -0.43), 1, 1));
  }
  const std::vector<Growth> all = growth(sweep);
  for (const auto& [axis, of, exponent, points] : {std::tuple{Axis::kSize, "position error", -0.61, 8},
                                                   {Axis::kSize, "vision time", 0.83, 8},
                                                   {Axis::kSize, "rendering time", 1.07, 4},
                                                   {Axis::kFrames, "position error", -0.43, 3}}) {
    const Growth* g = find(all, axis, of);
    ASSERT_TRUE(g) << of;
    EXPECT_NEAR(g->exponent, exponent, kDigits) << of;
    EXPECT_EQ(g->points, points) << of;
    EXPECT_LT(g->low, exponent) << of;
    EXPECT_GT(g->high, exponent) << of;
  }
  // Four and six landmarks at the same sizes: errors by 1/3.7, a power of log(3.7) / log(4/6) = -3.23.
  const Growth* landmarks = find(all, Axis::kLandmarks, "position error");
  ASSERT_TRUE(landmarks);
  EXPECT_NEAR(landmarks->exponent, std::log(3.7) / std::log(4.0 / 6), kDigits);
  EXPECT_TRUE(find(all, Axis::kLandmarks, "vision time"));
  EXPECT_FALSE(find(all, Axis::kFrames, "vision time"));
}

TEST(Growth, NeedsTwoSizesWithAnInterval) {
  Sweep sweep;
  sweep.settings = {result_of(with_size(160), 0.01, 1, 1), result_of(with_antialias(3), 0.01, 1, 1)};
  EXPECT_TRUE(growth(sweep).empty());
  sweep.settings = {result_of(with_size(160), 0.01, 1, 1), result_of(with_size(320), 0.01, 1, 1)};
  EXPECT_EQ(growth(sweep).size(), 3u);
  sweep.settings[1].position_m->mean = {0.01, 0, std::numeric_limits<double>::infinity()};
  EXPECT_EQ(growth(sweep).size(), 2u);
}

Sweep of_frames(const std::vector<std::pair<double, double>>& error_and_percent) {
  Sweep sweep;
  Setting s = usual_setting();
  for (const auto& [error_m, percent] : error_and_percent) {
    sweep.settings.push_back(result_of(s, error_m, 1, 1, percent));
    s.frames *= 2;
  }
  return sweep;
}

/// Logarithms of 1, 2, 4 frames and of errors 0, d, 0 give exponent 0 and residuals -d/3, 2d/3, -d/3 with one degree of
/// freedom, whose t is 12.7062. The half-width is t sqrt(2/3) d / (sqrt(2) log 2).
TEST(Growth, IsUncertainWhereThereIsNoPowerLaw) {
  constexpr double kD = 0.3, kT1 = 12.7062047, kDigits = 1e-6;
  const double half = kT1 * std::sqrt(1.0 / 3) * kD / std::log(2.0);
  const std::vector<Growth> all = growth(of_frames({{0.01, 5}, {0.01 * std::exp(kD), 5}, {0.01, 5}}));
  const Growth* g = find(all, Axis::kFrames, "position error");
  ASSERT_TRUE(g);
  EXPECT_NEAR(g->exponent, 0, kDigits);
  EXPECT_NEAR(g->low, -half, kDigits);
  EXPECT_NEAR(g->high, half, kDigits);
}

/// The point at 4 frames lies off the law of the other two by a factor of 2, and its interval is a hundred times wider
/// (5 % against 131 = 1.05^100): its weight, 1e-4 of theirs, moves the exponent by less than 1e-3.
TEST(Growth, WeighsAPointByItsInterval) {
  constexpr double kMoves = 1e-3;
  const std::vector<Growth> all = growth(of_frames({{0.01, 5}, {0.005, 5}, {0.005, 100 * (std::pow(1.05, 100) - 1)}}));
  const Growth* g = find(all, Axis::kFrames, "position error");
  ASSERT_TRUE(g);
  EXPECT_NEAR(g->exponent, -1, kMoves);
}

/// Errors scatter as their intervals state; the exponent's interval contains the planted exponent as often as it
/// states.
TEST(Growth, IntervalContainsThePlantedExponent) {
  constexpr int kTrials = 1000;
  constexpr double kSigma = 0.1, kExponent = -0.5, kLevel = 0.95;
  // The wider of two intervals contains it somewhat more often than 95 %; three standard deviations below that fail.
  const double least = kLevel - 3 * std::sqrt(kLevel * (1 - kLevel) / kTrials);
  std::mt19937_64 engine(1987);
  std::normal_distribution<double> normal(0, kSigma);
  int held = 0;
  for (int i = 0; i < kTrials; ++i) {
    Sweep sweep;
    for (const int width : {160, 240, 320, 480, 640, 800}) {
      const Setting s = with_size(width);
      const double error = std::pow(double(width), 2 * kExponent) * std::exp(normal(engine));
      sweep.settings.push_back(result_of(s, error, 1, 1, 100 * (std::exp(1.96 * kSigma) - 1)));
    }
    const std::vector<Growth> all = growth(sweep);
    const Growth* g = find(all, Axis::kSize, "position error");
    ASSERT_TRUE(g);
    held += g->low <= kExponent && kExponent <= g->high;
  }
  EXPECT_GE(double(held) / kTrials, least);
  EXPECT_LT(held, kTrials);  // and it is not unlimited
}

}  // namespace
}  // namespace twocone::tradeoff

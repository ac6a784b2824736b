// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/choice.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tradeoff/a_sweep.h"

namespace twocone::tradeoff {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

/// Setting i searches for 3 + i landmarks, so that a check can recognise it.
Setting numbered(int i) {
  Setting s = usual_setting();
  s.landmarks = 3 + i;
  return s;
}

/// Returns settings with errors of 12, 6, 4, 2 and 1 mm at 1, 2, 4, 8 and 16 ms; not in that order.
Sweep five_settings() {
  Sweep sweep;
  const double errors_m[] = {0.004, 0.012, 0.001, 0.002, 0.006}, times_s[] = {0.004, 0.001, 0.016, 0.008, 0.002};
  for (int i = 0; i < 5; ++i) sweep.settings.push_back(result_of(numbered(i), errors_m[i], times_s[i], 1));
  return sweep;
}

constexpr int kEpisodes = 40;
/// Returns fresh episodes whose errors and times are within one per cent of the sweep's mean, times the factors.
Check like_the_sweep(const Setting& setting, double error_factor = 1, double time_factor = 1) {
  const SettingResult s = five_settings().settings[std::size_t(setting.landmarks - 3)];
  Check fresh;
  for (int episode = 0; episode < kEpisodes; ++episode) {
    const double off = 1 + 0.01 * std::sin(episode);
    fresh.position_errors_m.push_back({error_factor * s.position_m->mean.value * off});
    fresh.robot_times_s.push_back({time_factor * s.robot_time_s().value * off});
  }
  fresh.answered_share = 1;
  return fresh;
}

constexpr Requirement target(double m) { return {Goal::kTarget, m}; }
constexpr Requirement budget(double s) { return {Goal::kBudget, s}; }

TEST(Candidates, AreTheSettingsWithinTheRequirementInOrder) {
  const Sweep sweep = five_settings();
  EXPECT_THAT(candidates(sweep, target(0.005)), ElementsAre(0, 3, 2));
  EXPECT_THAT(candidates(sweep, budget(0.005)), ElementsAre(0, 4, 1));
  EXPECT_THAT(candidates(sweep, target(0.001)), IsEmpty());  // 1 mm is not below 1 mm
  EXPECT_THAT(candidates(sweep, budget(0.0005)), IsEmpty());
}

TEST(Candidates, OfEqualOnesTakeTheBetterInTheOtherFirst) {
  Sweep sweep;
  sweep.settings = {result_of(numbered(0), 0.003, 0.002, 1), result_of(numbered(1), 0.002, 0.002, 1),
                    result_of(numbered(2), 0.002, 0.001, 1), result_of(numbered(3), 0.002, 0.001, 1)};
  EXPECT_THAT(candidates(sweep, target(0.01)), ElementsAre(2, 3, 1, 0));
  EXPECT_THAT(candidates(sweep, budget(0.01)), ElementsAre(2, 3, 1, 0));
}

TEST(Candidates, AreSettingsThatARobotCanHave) {
  Sweep sweep = five_settings();
  sweep.settings[0].setting.images.effects = Effects::kFlat;
  sweep.settings[3].setting.images.effects = Effects::kNoise;
  sweep.settings[2].answered = 89;
  EXPECT_THAT(candidates(sweep, target(0.007)), ElementsAre(4));
  sweep.settings[4].position_m.reset();
  EXPECT_THAT(candidates(sweep, target(0.007)), IsEmpty());
}

TEST(Candidates, LeaveOutWhatIsNotANumber) {
  Sweep sweep = five_settings();
  sweep.settings[0].position_m->mean.value = std::numeric_limits<double>::quiet_NaN();
  sweep.settings[3].robot.p95_s.value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(candidates(sweep, target(0.005)), ElementsAre(2));
  EXPECT_THAT(candidates(sweep, budget(0.02)), ElementsAre(2, 4, 1));
}

TEST(Choose, TakesTheCheapestThatIsConfirmed) {
  const Sweep sweep = five_settings();
  int checks = 0;
  const auto choice = choose(sweep, target(0.005), [&](const Setting& s) -> Result<Check> {
    ++checks;
    return like_the_sweep(s);
  });
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->setting, 0u);
  EXPECT_EQ(checks, 1);
  ASSERT_EQ(choice->validations.size(), 1u);
  const Validation& validation = choice->validations[0];
  EXPECT_TRUE(validation.is_confirmed);
  EXPECT_EQ(validation.episodes, kEpisodes);
  EXPECT_EQ(validation.upper_limit_m, mean_upper_limit(like_the_sweep(numbered(0)).position_errors_m, 1 - 0.05 / 5));
  EXPECT_EQ(choice->why,
            describe(numbered(0)) +
                ": 4 mm on 40 fresh episodes, upper limit 4.01 mm (1 - 0.05/5) below 5 mm, 4.04 ms per frame; of "
                "the others that are cheaper, 2 have a mean of 5 mm or more");
}

TEST(Choose, ContinuesWhereTheFirstIsNotConfirmedOnFreshEpisodes) {
  const Sweep sweep = five_settings();
  const auto choice = choose(sweep, target(0.005), [](const Setting& s) -> Result<Check> {
    return like_the_sweep(s, s == numbered(0) ? 1.249 : 1.2);  // 4.996 mm: the mean is below 5 mm, its limit is not
  });
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->setting, 3u);
  ASSERT_EQ(choice->validations.size(), 2u);
  EXPECT_EQ(choice->validations[0].setting, 0u);
  EXPECT_FALSE(choice->validations[0].is_confirmed);
  EXPECT_LT(choice->validations[0].mean_m.value, 0.005);
  EXPECT_TRUE(choice->validations[1].is_confirmed);
  EXPECT_THAT(choice->why,
              HasSubstr("; 1 setting was tested before it, beginning with the cheapest, and not confirmed; of the "
                        "others that are cheaper, 2 have a mean of 5 mm or more"));
}

TEST(Choose, RequiresAnswersOnFreshEpisodesToo) {
  const auto choice = choose(five_settings(), target(0.005), [](const Setting& s) -> Result<Check> {
    Check fresh = like_the_sweep(s);
    if (s == numbered(0)) fresh.answered_share = 0.89;
    if (s == numbered(3)) fresh = {};  // no answer at all, and no times
    return fresh;
  });
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->setting, 2u);
  ASSERT_EQ(choice->validations.size(), 3u);
  EXPECT_EQ(choice->validations[1].episodes, 0);
  EXPECT_TRUE(std::isinf(choice->validations[1].upper_limit_m));
  EXPECT_TRUE(std::isinf(choice->validations[1].robot_time_s.high));
}

TEST(Choose, TakesTheMostAccurateWithinABudget) {
  // The time of setting 3 has its upper limit above 10 ms on fresh episodes, though its value is below.
  const auto choice = choose(five_settings(), budget(0.010), [](const Setting& s) -> Result<Check> {
    return like_the_sweep(s, 1, s == numbered(3) ? 1.2377 : 1);
  });
  ASSERT_TRUE(choice);
  ASSERT_EQ(choice->validations.size(), 2u);
  EXPECT_EQ(choice->validations[0].setting, 3u);
  EXPECT_LT(choice->validations[0].mean_m.value, choice->validations[1].mean_m.value);
  EXPECT_LT(choice->validations[0].robot_time_s.value, 0.010);
  EXPECT_EQ(choice->setting, 0u);
  EXPECT_THAT(choice->why,
              StartsWith(describe(numbered(0)) + ": 4.04 ms per frame (95 % quantile) on 40 fresh episodes, upper "
                                                 "limit 4.04 ms below 10 ms, 4 mm ("));
  EXPECT_THAT(choice->why,
              HasSubstr("1 setting was tested before it, beginning with the most accurate, and not confirmed; of the "
                        "others that are more accurate, 1 takes 10 ms or more"));
}

TEST(Choose, CountsAsCheaperOnlyBeyondBothIntervals) {
  Sweep sweep = five_settings();
  // 5 % apart from setting 0 (4 ms, 5 %): neither cheaper nor dearer.
  sweep.settings.push_back(result_of(numbered(5), 0.009, 0.0038, 1));
  sweep.settings.push_back(result_of(numbered(6), 0.001, 0.0001, 1));
  sweep.settings.back().answered = 50;
  sweep.settings.push_back(result_of(numbered(7), 0.001, 0.0001, 1));
  sweep.settings.back().setting.images.effects = Effects::kFlat;
  const auto choice = choose(sweep, target(0.005), [](const Setting& s) -> Result<Check> { return like_the_sweep(s); });
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->setting, 0u);
  EXPECT_THAT(choice->why, HasSubstr("cheaper, 2 have a mean of 5 mm or more, 1 answers less often than in 90 % of the "
                                     "frames, 1 is for images with other effects than the scene's"));
}

TEST(Choose, NamesTheNearestSettingWhereNoneIsConfirmed) {
  const auto like = [](const Setting& s) -> Result<Check> { return like_the_sweep(s, 3); };
  const auto tried = choose(five_settings(), target(0.0021), like);
  ASSERT_TRUE(tried);
  EXPECT_FALSE(tried->setting);
  EXPECT_EQ(tried->validations.size(), 2u);
  EXPECT_THAT(tried->why,
              StartsWith("no setting is confirmed: of 2 settings tested, the nearest is " + describe(numbered(2)) +
                         ": 3 mm on 40 fresh episodes, upper limit 3.01 mm (1 - 0.05/5) not below 2.1 mm"));
  const auto untried = choose(five_settings(), target(0.0005), like);
  ASSERT_TRUE(untried);
  EXPECT_TRUE(untried->validations.empty());
  EXPECT_EQ(untried->why,
            "no setting is confirmed: no mean position error of the sweep is below 0.5 mm; the nearest is " +
                describe(numbered(2)) + " with 1 mm (0.952 to 1.05)");
  const auto slow = choose(five_settings(), budget(0.0005), like);
  ASSERT_TRUE(slow);
  EXPECT_THAT(slow->why, HasSubstr("no time of a frame of the sweep is below 0.5 ms; the nearest is " +
                                   describe(numbered(1)) + " with 1 ms"));
  const auto empty = choose({}, target(0.005), like);
  ASSERT_TRUE(empty);
  EXPECT_THAT(empty->why, StartsWith("no setting is confirmed: none with the scene's own effects answers in 90 %"));
  EXPECT_THAT(empty->why, Not(HasSubstr("inf")));
}

TEST(Choose, EndsWithTheErrorOfTheCheck) {
  int checks = 0;
  const auto choice = choose(five_settings(), target(0.005), [&](const Setting&) -> Result<Check> {
    ++checks;
    return Error{ErrorCode::kUnavailable, "no POV-Ray"};
  });
  ASSERT_FALSE(choice);
  EXPECT_EQ(choice.error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(choice.error().message, "no POV-Ray");
  EXPECT_EQ(checks, 1);
}

}  // namespace
}  // namespace twocone::tradeoff

// SPDX-License-Identifier: Apache-2.0
// Checks the effect of `estimator:` on a frame: stages, landmarks, bearings, the adaptive stage and its time budget.
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/estimation/estimator.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/runlog/answer_rows.h"
#include "tests/support/lab_robot.h"
#include "tests/support/synthetic_lab.h"
#include "tests/support/value.h"

namespace twocone::estimation {
namespace {

namespace lab = testing_support;
using testing_support::lab_robot;
using testing_support::value;
using vision::RangeVerdict;

constexpr const char* kNames[] = {"red", "green", "blue", "cyan", "magenta", "yellow"};

config::Map map() {
  config::Map map;
  map.file = "lab.map.yaml";
  map.bounds = {-3.05, 3.05, -2.55, 2.55};
  for (const auto& landmark : lab::six_landmarks()) {
    map.landmarks.push_back({kNames[map.landmarks.size()],
                             {landmark.colour.x(), landmark.colour.y(), landmark.colour.z()},
                             landmark.centre_m.x(),
                             landmark.centre_m.y(),
                             landmark.radius_m,
                             landmark.top_m});
  }
  return map;
}

const Eigen::Vector2d kPosition_m(0.13, -0.21);
constexpr double kHeading_rad = 0.37;

struct Frame {
  Image lower, upper;
};
const Frame& frame() {
  static const Frame frame = [] {
    const lab::SyntheticRig rig(vision::lab_rig(), {.level = 0.45, .cells = 24, .contrast = 0.3});
    std::mt19937_64 random(3);
    const auto pair =
        rig.take({lab::seen_from(lab::six_landmarks(), kPosition_m, kHeading_rad), {}, {}}, {1, 1}, random);
    return Frame{as_image(pair.lower), as_image(pair.upper)};
  }();
  return frame;
}

estimation::FrameAnswer answer(const config::EstimatorKeys& keys,
                               estimation::Method method = estimation::Method::kOutline,
                               std::function<double()> clock_s = estimation::steady_time_s) {
  config::Robot asked = lab_robot();
  asked.estimator = keys;
  return value(estimation::Estimator(method, asked, map(), std::move(clock_s)).answer(frame().lower, frame().upper));
}

double sigma_m(const estimation::FrameAnswer& a) {
  return std::sqrt((*a.fix.covariance)(0, 0) + (*a.fix.covariance)(1, 1));
}
double error_m(const estimation::FrameAnswer& a) { return (*a.fix.position_m - kPosition_m).norm(); }

TEST(EstimatorKeys, UnknownNamesAreRefused) {
  EXPECT_THAT([] { answer({.stage = "rough"}); },
              testing::ThrowsMessage<config::FileError>(
                  "lab.yaml: estimator.stage is 'rough', must be found, coarse, fine or adaptive"));
  EXPECT_THAT(
      [] {
        answer({.landmarks = {"red", "pink", "blue", "teal"}});
      },
      testing::ThrowsMessage<config::FileError>(
          "lab.yaml: estimator.landmarks has 'pink', 'teal', which lab.map.yaml does not; there are: red, "
          "green, blue, cyan, magenta, yellow"));
}

// Catches an estimator that ignores the walls. The fix itself is the same.
TEST(Estimator, AFixOutsideTheBoundsIsNone) {
  config::Map small = map();
  small.bounds.min_x_m = kPosition_m.x() + 0.1;
  const auto answer_of = [&](Method method) {
    return value(Estimator(method, lab_robot(), small).answer(frame().lower, frame().upper));
  };
  const FrameAnswer judged = answer_of(Method::kOutline);
  EXPECT_EQ(judged.fix.verdict, localisation::FixVerdict::kOutOfBounds);
  EXPECT_LT(error_m(judged), 0.01) << "the position is still there";
  EXPECT_NE(answer_of(Method::kPaper).fix.verdict, localisation::FixVerdict::kOutOfBounds)
      << "the baseline is not changed";

  const runlog::PoseRow truth{0, kPosition_m.x(), kPosition_m.y(), kHeading_rad};
  const runlog::FixRow row = runlog::to_rows(5, 1.0, judged, small, &truth).fixes.front();
  EXPECT_EQ(row.verdict, "out_of_bounds");
  EXPECT_TRUE(row.x_m && row.var_x_m2 && row.cov_x_heading_m_rad);
  EXPECT_FALSE(row.error_m) << "a position that is no answer has no error";
}

TEST(EstimatorKeys, StagesAreTheRangingsOwn) {
  const auto found = answer({.stage = "found"});
  const auto coarse = answer({.stage = "coarse"});
  const auto fine = answer({});
  EXPECT_EQ(found.timing.refined, 0);
  EXPECT_EQ(coarse.timing.refined, 0);
  EXPECT_EQ(fine.timing.refined, 6);
  EXPECT_LT(sigma_m(coarse), sigma_m(found) / 3);
  EXPECT_LT(sigma_m(fine), sigma_m(coarse));
  EXPECT_LT(error_m(found), 3 * sigma_m(found));
  EXPECT_LT(error_m(fine), 3 * sigma_m(fine));
  for (const estimation::FrameAnswer* a : {&found, &coarse, &fine}) {
    EXPECT_GT(a->timing.vision_s, 0);
    EXPECT_GT(a->timing.localisation_s, 0);
    EXPECT_GT(a->timing.wall_s, 0);
    EXPECT_FALSE(a->timing.is_over_budget);
  }
}

TEST(EstimatorKeys, LandmarksThatAreNotAskedForAreNotSeen) {
  for (const estimation::Method method : {estimation::Method::kPaper, estimation::Method::kOutline}) {
    for (const char* stage : {"found", "fine", "adaptive"}) {
      const auto some = answer({.stage = stage, .landmarks = {"yellow", "green", "cyan"}}, method);
      ASSERT_EQ(some.ranges.size(), 6U);
      for (std::size_t k = 0; k < 6; ++k) {
        const bool is_asked = k == 5 || k == 1 || k == 3;
        EXPECT_EQ(some.ranges[k].range_m.has_value(), is_asked) << kNames[k] << ", " << stage;
        if (is_asked) continue;
        EXPECT_EQ(some.ranges[k].verdict, RangeVerdict::kNotSeen) << kNames[k] << ", " << stage;
      }
      EXPECT_TRUE(some.fix.position_m) << stage;
    }
  }
}

TEST(EstimatorKeys, WithoutBearingsThereIsNoHeading) {
  for (const char* stage : {"found", "fine", "adaptive"}) {
    const auto ranges = answer({.stage = stage, .bearings = false});
    EXPECT_EQ(ranges.fix.verdict, localisation::FixVerdict::kOk) << stage;
    EXPECT_FALSE(ranges.fix.heading_rad) << stage;
    EXPECT_LT(error_m(ranges), 4 * sigma_m(ranges)) << stage;
    EXPECT_TRUE(ranges.ranges[0].bearing_rad) << "still measured";
  }
}

TEST(Adaptive, NothingIsRefinedIfTheFoundAnswerIsEnough) {
  const auto found = answer({.stage = "found"});
  const auto adaptive = answer({.stage = "adaptive", .enough_m = 10});
  EXPECT_EQ(adaptive.timing.refined, 0);
  EXPECT_EQ(*adaptive.fix.position_m, *found.fix.position_m);
  EXPECT_EQ(*adaptive.fix.covariance, *found.fix.covariance);
}

// The same outlines from other start values and with the earlier noise give two answers from the same pixels.
constexpr double kSameFix_sigmas = 1;

TEST(Adaptive, AllIsRefinedIfNothingIsEnough) {
  const auto fine = answer({});
  const auto adaptive = answer({.stage = "adaptive", .enough_m = 1e-9});
  EXPECT_EQ(adaptive.timing.refined, 6);
  EXPECT_LT((*adaptive.fix.position_m - *fine.fix.position_m).norm(), kSameFix_sigmas * sigma_m(fine));
  EXPECT_NEAR(sigma_m(adaptive), sigma_m(fine), 0.3 * sigma_m(fine));
}

TEST(Adaptive, RefinesNearLandmarksFirstAndStopsWhereItIsEnough) {
  const double enough_m = 3 * sigma_m(answer({}));
  const auto adaptive = answer({.stage = "adaptive", .enough_m = enough_m});
  EXPECT_LE(sigma_m(adaptive), enough_m);
  EXPECT_LT(adaptive.timing.refined, 6);
  EXPECT_GE(adaptive.timing.refined, 2);
  const auto found = answer({.stage = "found"});
  double refined_m = 0;
  double left_m = 0;
  int refined = 0;
  for (std::size_t k = 0; k < 6; ++k) {
    const bool is_refined = *adaptive.ranges[k].sigma_range_m < *found.ranges[k].sigma_range_m / 2;
    refined += is_refined ? 1 : 0;
    (is_refined ? refined_m : left_m) += *found.ranges[k].range_m;
  }
  EXPECT_EQ(refined, adaptive.timing.refined);
  EXPECT_LT(refined_m / refined, left_m / (6 - refined));
}

TEST(Adaptive, WithoutATimeBudgetTheAnswerIsAFunctionOfTheImages) {
  const auto one = answer({.stage = "adaptive", .enough_m = 3e-4});
  const auto other = answer({.stage = "adaptive", .enough_m = 3e-4});
  EXPECT_EQ(*one.fix.position_m, *other.fix.position_m);
  EXPECT_EQ(*one.fix.covariance, *other.fix.covariance);
}

/// Returns a clock that advances by a tenth of a second with each reading.
std::function<double()> slow_clock() {
  return [now_s = 0.0]() mutable { return now_s += 0.1; };
}

TEST(Adaptive, ATimeBudgetEndsItBeforeARefinementThatWouldExceedIt) {
  const config::EstimatorKeys all{.stage = "adaptive", .enough_m = 1e-9};
  int before = 0;
  for (const double budget_s : {0.55, 0.95, 1.35, 10.0}) {
    config::EstimatorKeys requirement = all;
    requirement.budget_s = budget_s;
    const auto bound = answer(requirement, estimation::Method::kOutline, slow_clock());
    EXPECT_LE(bound.timing.wall_s, budget_s + 1e-9);
    EXPECT_FALSE(bound.timing.is_over_budget) << budget_s << " s";
    EXPECT_GE(bound.timing.refined, before) << budget_s << " s";
    EXPECT_TRUE(bound.fix.position_m) << budget_s << " s";
    before = bound.timing.refined;
  }
  EXPECT_EQ(before, 6);
  config::EstimatorKeys tight = all;
  tight.budget_s = 0.05;
  const auto over = answer(tight, estimation::Method::kOutline, slow_clock());
  EXPECT_EQ(over.timing.refined, 0);
  EXPECT_TRUE(over.timing.is_over_budget);
  EXPECT_TRUE(over.fix.position_m) << "late, but still an answer";
}

TEST(Adaptive, AnotherStageHasNoTimeBudget) {
  EXPECT_FALSE(answer({.budget_s = 0.05}, estimation::Method::kOutline, slow_clock()).timing.is_over_budget);
  EXPECT_FALSE(
      answer({.stage = "adaptive", .budget_s = 0.05}, estimation::Method::kPaper, slow_clock()).timing.is_over_budget);
}

}  // namespace
}  // namespace twocone::estimation

// SPDX-License-Identifier: Apache-2.0
// What `estimator:` of a robot file makes of a frame: stages, landmarks, bearings, the adaptive stage and its budget.
#include <random>

#include <gtest/gtest.h>

#include "apps/files/file_error.h"
#include "apps/files/to_layers.h"
#include "apps/runs/estimator.h"
#include "tests/support/synthetic_lab.h"

namespace twocone::runs {
namespace {

namespace lab = vision::testing_support;
using vision::RangeVerdict;

constexpr const char* kNames[] = {"red", "green", "blue", "cyan", "magenta", "yellow"};

files::Robot robot() {
  files::Robot robot;
  robot.file = "lab.yaml";
  robot.lower.width_px = robot.upper.width_px = lab::kPicture.width;
  robot.lower.height_px = robot.upper.height_px = lab::kPicture.height;
  files::RigView view;
  view.mirror_radius_m = 0.06;
  view.lens_to_tip_m = 0.12;
  view.centre_px = {319.5, 239.5};
  view.rim_radius_px = 236;
  robot.rig.lower = robot.rig.upper = view;
  robot.rig.mirror_separation_m = 0.30;
  robot.rig.lens_height_m = 0.25;
  return robot;
}

files::Map map() {
  files::Map map;
  map.file = "lab.map.yaml";
  map.bounds = {-3.05, 3.05, -2.55, 2.55};
  for (const auto& pillar : lab::six_pillars()) {
    map.landmarks.push_back({kNames[map.landmarks.size()],
                             {pillar.colour.x(), pillar.colour.y(), pillar.colour.z()},
                             pillar.centre_m.x(),
                             pillar.centre_m.y(),
                             pillar.radius_m,
                             pillar.top_m});
  }
  return map;
}

struct Asked {
  std::string stage = "fine";
  std::vector<std::string> landmarks{};
  bool bearings = true;
  double enough_m = 0.001;
  std::optional<double> budget_s{};

  [[nodiscard]] files::EstimatorKeys keys() const { return {"", stage, landmarks, bearings, enough_m, budget_s}; }
};

const Eigen::Vector2d kPosition_m(0.13, -0.21);
constexpr double kHeading_rad = 0.37;

struct Frame {
  Image lower, upper;
};
const Frame& frame() {
  static const Frame frame = [] {
    const lab::SyntheticRig rig(lab::lab_rig(), {.level = 0.45, .cells = 24, .contrast = 0.3});
    std::mt19937_64 random(3);
    const auto pair = rig.take({lab::seen_from(lab::six_pillars(), kPosition_m, kHeading_rad), {}, {}}, {1, 1}, random);
    const auto image = [](const cv::Mat& picture) {
      return Image{picture.cols, picture.rows, PixelFormat::kRgb8,
                   std::vector<std::uint8_t>(picture.datastart, picture.dataend)};
    };
    return Frame{image(pair.lower), image(pair.upper)};
  }();
  return frame;
}

FrameAnswer answer(const Asked& wish, Method method = Method::kFull, std::function<double()> clock_s = steady_time_s) {
  files::Robot asked = robot();
  asked.estimator = wish.keys();
  const auto answer = Estimator(method, asked, map(), std::move(clock_s)).answer(frame().lower, frame().upper);
  if (!answer) throw std::runtime_error(answer.error().message);
  return *answer;
}

double sigma_m(const FrameAnswer& a) { return std::sqrt((*a.fix.covariance)(0, 0) + (*a.fix.covariance)(1, 1)); }
double error_m(const FrameAnswer& a) { return (*a.fix.position_m - kPosition_m).norm(); }

std::string refusal(const Asked& wish) {
  files::Robot asked = robot();
  asked.estimator = wish.keys();
  try {
    (void)Estimator(Method::kFull, asked, map());
  } catch (const files::FileError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(EstimatorKeys, UnknownNamesAreRefused) {
  EXPECT_EQ(refusal({.stage = "rough"}),
            "lab.yaml: estimator.stage is 'rough', must be found, coarse, fine or adaptive");
  EXPECT_EQ(refusal({.landmarks = {"red", "pink", "blue", "teal"}}),
            "lab.yaml: estimator.landmarks has 'pink', 'teal', which lab.map.yaml does not; there are: red, green, "
            "blue, cyan, magenta, yellow");
}

// Catches an estimator that forgets the walls; the fix itself is the same.
TEST(Estimator, AFixOutsideTheBoundsIsNone) {
  files::Map small = map();
  small.bounds.min_x_m = kPosition_m.x() + 0.1;
  const auto judged = Estimator(Method::kFull, robot(), small).answer(frame().lower, frame().upper);
  ASSERT_TRUE(judged);
  EXPECT_EQ(judged->fix.verdict, localisation::FixVerdict::kOutOfBounds);
  EXPECT_LT(error_m(*judged), 0.01) << "the position is still given";
  const auto by_paper = Estimator(Method::kPaper, robot(), small).answer(frame().lower, frame().upper);
  ASSERT_TRUE(by_paper);
  EXPECT_NE(by_paper->fix.verdict, localisation::FixVerdict::kOutOfBounds) << "the baseline stays as it is";

  const PoseRow truth{0, kPosition_m.x(), kPosition_m.y(), kHeading_rad};
  const FixRow row = to_rows(5, 1.0, *judged, small, &truth).fixes.front();
  EXPECT_EQ(row.verdict, "out_of_bounds");
  EXPECT_TRUE(row.x_m && row.var_x_m2 && row.cov_x_heading_m_rad);
  EXPECT_FALSE(row.error_m) << "what is no answer has no error";
}

TEST(EstimatorKeys, StagesAreTheRangingsOwn) {
  const auto found = answer({.stage = "found"});
  const auto coarse = answer({.stage = "coarse"});
  const auto fine = answer({});
  EXPECT_EQ(found.effort.refined, 0);
  EXPECT_EQ(coarse.effort.refined, 0);
  EXPECT_EQ(fine.effort.refined, 6);
  EXPECT_LT(sigma_m(coarse), sigma_m(found) / 3);
  EXPECT_LT(sigma_m(fine), sigma_m(coarse));
  EXPECT_LT(error_m(found), 3 * sigma_m(found));
  EXPECT_LT(error_m(fine), 3 * sigma_m(fine));
  for (const FrameAnswer* a : {&found, &coarse, &fine}) {
    EXPECT_GT(a->effort.vision_s, 0);
    EXPECT_GT(a->effort.localisation_s, 0);
    EXPECT_GT(a->effort.wall_s, 0);
    EXPECT_FALSE(a->effort.is_over_budget);
  }
}

TEST(EstimatorKeys, LandmarksThatAreNotAskedForAreNotSeen) {
  for (const Method method : {Method::kPaper, Method::kFull}) {
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
    EXPECT_TRUE(ranges.ranges[0].bearing_rad) << "measured all the same";
  }
}

TEST(Adaptive, WhereTheFoundAnswerIsEnoughNothingIsRefined) {
  const auto found = answer({.stage = "found"});
  const auto adaptive = answer({.stage = "adaptive", .enough_m = 10});
  EXPECT_EQ(adaptive.effort.refined, 0);
  EXPECT_EQ(*adaptive.fix.position_m, *found.fix.position_m);
  EXPECT_EQ(*adaptive.fix.covariance, *found.fix.covariance);
}

// The same outlines from other starts and with the noise of those before: two answers from the same pixels.
constexpr double kSameFix_sigmas = 1;

TEST(Adaptive, WhereNothingIsEnoughAllIsRefined) {
  const auto fine = answer({});
  const auto adaptive = answer({.stage = "adaptive", .enough_m = 1e-9});
  EXPECT_EQ(adaptive.effort.refined, 6);
  EXPECT_LT((*adaptive.fix.position_m - *fine.fix.position_m).norm(), kSameFix_sigmas * sigma_m(fine));
  EXPECT_NEAR(sigma_m(adaptive), sigma_m(fine), 0.3 * sigma_m(fine));
}

TEST(Adaptive, RefinesNearLandmarksFirstAndStopsWhereItIsEnough) {
  const double enough_m = 3 * sigma_m(answer({}));
  const auto adaptive = answer({.stage = "adaptive", .enough_m = enough_m});
  EXPECT_LE(sigma_m(adaptive), enough_m);
  EXPECT_LT(adaptive.effort.refined, 6);
  EXPECT_GE(adaptive.effort.refined, 2);
  const auto found = answer({.stage = "found"});
  double refined_m = 0;
  double left_m = 0;
  int refined = 0;
  for (std::size_t k = 0; k < 6; ++k) {
    const bool is_refined = *adaptive.ranges[k].sigma_range_m < *found.ranges[k].sigma_range_m / 2;
    refined += is_refined ? 1 : 0;
    (is_refined ? refined_m : left_m) += *found.ranges[k].range_m;
  }
  EXPECT_EQ(refined, adaptive.effort.refined);
  EXPECT_LT(refined_m / refined, left_m / (6 - refined));
}

TEST(Adaptive, WithoutABudgetTheAnswerIsAFunctionOfThePictures) {
  const auto one = answer({.stage = "adaptive", .enough_m = 3e-4});
  const auto other = answer({.stage = "adaptive", .enough_m = 3e-4});
  EXPECT_EQ(*one.fix.position_m, *other.fix.position_m);
  EXPECT_EQ(*one.fix.covariance, *other.fix.covariance);
}

/// Each reading is a tenth of a second after the one before.
std::function<double()> slow_clock() {
  return [now_s = 0.0]() mutable { return now_s += 0.1; };
}

TEST(Adaptive, ABudgetEndsItBeforeARefinementThatWouldPassIt) {
  const Asked all{.stage = "adaptive", .enough_m = 1e-9};
  int before = 0;
  for (const double budget_s : {0.55, 0.95, 1.35, 10.0}) {
    Asked wish = all;
    wish.budget_s = budget_s;
    const auto bound = answer(wish, Method::kFull, slow_clock());
    EXPECT_LE(bound.effort.wall_s, budget_s + 1e-9);
    EXPECT_FALSE(bound.effort.is_over_budget) << budget_s << " s";
    EXPECT_GE(bound.effort.refined, before) << budget_s << " s";
    EXPECT_TRUE(bound.fix.position_m) << budget_s << " s";
    before = bound.effort.refined;
  }
  EXPECT_EQ(before, 6);
  Asked tight = all;
  tight.budget_s = 0.05;
  const auto over = answer(tight, Method::kFull, slow_clock());
  EXPECT_EQ(over.effort.refined, 0);
  EXPECT_TRUE(over.effort.is_over_budget);
  EXPECT_TRUE(over.fix.position_m) << "late, and an answer all the same";
}

TEST(Adaptive, AnotherStageHasNoBudget) {
  EXPECT_FALSE(answer({.budget_s = 0.05}, Method::kFull, slow_clock()).effort.is_over_budget);
  EXPECT_FALSE(answer({.stage = "adaptive", .budget_s = 0.05}, Method::kPaper, slow_clock()).effort.is_over_budget);
}

}  // namespace
}  // namespace twocone::runs

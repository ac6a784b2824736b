// SPDX-License-Identifier: Apache-2.0
#include "vision/triangulation.h"

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "tests/support/disparity_range.h"
#include "tests/support/error_of.h"
#include "tests/support/special_doubles.h"
#include "tests/vision/lab_rig.h"

namespace twocone::vision {
namespace {

using twocone::testing_support::kEps;
using twocone::testing_support::kInf;
using twocone::testing_support::kNaN;

constexpr double kRadius_m = 0.083;
constexpr double kTop_m = 1.013;

/// The lab's: v s = 708 px x 0.3 m.
constexpr DisparityGeometry kLab = {
    .focal_length_px = 708, .mirror_separation_m = 0.3, .lens_to_tip_m = 0.12, .rim_radius_px = 236};

/// A rig whose mirrors both differ from the ideal in every parameter, each by other values.
Rig odd_rig() {
  MirrorViewSettings lower = lab_view(0.25);
  MirrorViewSettings upper = lab_view(0.553);
  lower.cone.apex_rad += 0.0052;
  lower.tilt_rad = {0.0087, -0.0061};
  lower.axis_offset_m = {0.0021, 0.0013};
  lower.azimuth_rad = 0.413;
  lower.distortion = {{-0.12, 0.04, 0.0011, -0.0007}, {702, 698}, {322, 238}};
  upper.cone.lens_to_tip_m = 0.117;
  upper.tilt_rad = {-0.0043, 0.0072};
  upper.axis_offset_m = {-0.0017, 0.0024};
  upper.centre_px = {316.3, 241.9};
  upper.azimuth_rad = -1.213;
  upper.mirrored = true;
  return {MirrorView(lower), MirrorView(upper)};
}

Eigen::Matrix2d covariance_px2(double sigma_px) {
  Eigen::Matrix2d c;
  c << 1.3, 0.4, 0.4, 0.8;
  return c * (sigma_px * sigma_px);
}

Sighting sighting_of(const MirrorView& view, const Eigen::Vector2d& p_BL_m, double sigma_px, double top_m = kTop_m) {
  return {.pixel_px = view.project(near_top_point(view, p_BL_m, kRadius_m, top_m).value()).value(),
          .covariance_px2 = covariance_px2(sigma_px)};
}

double apart(double a_rad, double b_rad) { return std::remainder(a_rad - b_rad, 2 * std::numbers::pi); }

TEST(RangeFromDisparity, R1OfTheHardCases) {
  const InverseRange r = range_from_disparity(81.06870229007633, 0.1, kLab);
  ASSERT_EQ(r.verdict, RangeVerdict::kOk);
  EXPECT_NEAR(*r.range_m, 2.5, 4 * kEps * 2.62);  // four roundings of range + d
  EXPECT_NEAR(*r.sigma_range_m, 2.62 * 2.62 * 0.1 / 212.4, 1e-15);
  EXPECT_NEAR(r.inverse_per_m, 1 / 2.62, 1e-15);
}

TEST(RangeFromDisparity, R2ZeroIsBeyondTheLimitWithItsSigma) {
  const InverseRange r = range_from_disparity(0, 0.1, kLab);
  EXPECT_EQ(r.verdict, RangeVerdict::kBeyondLimit);
  EXPECT_EQ(r.inverse_per_m, 0);
  EXPECT_DOUBLE_EQ(r.sigma_inverse_per_m, 0.1 / 212.4);
  EXPECT_FALSE(r.range_m);
}

TEST(RangeFromDisparity, R3NegativeNoiseGivesNoNegativeRange) {
  const InverseRange r = range_from_disparity(-0.3, 0.1, kLab);
  EXPECT_EQ(r.verdict, RangeVerdict::kBeyondLimit);
  EXPECT_NEAR(r.inverse_per_m / 1000, -1.41e-6, 0.005e-6);  // as printed, per mm
  EXPECT_FALSE(r.range_m);
  EXPECT_FALSE(r.sigma_range_m);
}

TEST(RangeFromDisparity, R4FarBelowItsOwnSigma) {
  const InverseRange r = range_from_disparity(1e-9, 0.1, kLab);
  EXPECT_EQ(r.verdict, RangeVerdict::kBeyondLimit);
  EXPECT_GT(r.inverse_per_m, 0);
  EXPECT_FALSE(r.range_m);
  EXPECT_EQ(range_from_disparity(1e-9, 1e-10, kLab).verdict, RangeVerdict::kOk) << "the same stands out of 1e-10 px";
}

TEST(RangeFromDisparity, R6BeyondTheRimIsImpossible) {
  EXPECT_EQ(range_from_disparity(2000, 0.1, kLab).verdict, RangeVerdict::kImpossible);
  EXPECT_EQ(range_from_disparity(236.001, 0.1, kLab).verdict, RangeVerdict::kImpossible);
  const InverseRange nearest = range_from_disparity(236, 0.1, kLab);
  ASSERT_EQ(nearest.verdict, RangeVerdict::kOk);
  EXPECT_NEAR(*nearest.range_m, 0.3 * (0.12 + 0.06) / 0.06 - 0.12, 4 * kEps);  // 780 mm
  DisparityGeometry close = kLab;
  close.mirror_separation_m = 0.03;  // would see to -30 mm
  EXPECT_EQ(range_from_disparity(236, 0.1, close).verdict, RangeVerdict::kImpossible);
}

TEST(RangeFromDisparity, R8TheErrorBudgetsNumbersFollow) {
  // At 2.5 m the near edge's disparity is 81.07 px; the numbers of the hard case R8 are rounded to 1 mm.
  const double disparity_px = 81.06870229007633;
  DisparityGeometry wrong = kLab;
  wrong.focal_length_px *= 1.01;
  EXPECT_NEAR(*range_from_disparity(disparity_px, 0.1, wrong).range_m - 2.5, 0.026, 0.0005);
  wrong.focal_length_px = 708.0 * 237 / 236;
  EXPECT_NEAR(*range_from_disparity(disparity_px, 0.1, wrong).range_m - 2.5, 0.011, 0.0005);
  const double nearer_m = *range_from_disparity(disparity_px + 1, 0.1, kLab).range_m;
  const double farther_m = *range_from_disparity(disparity_px - 1, 0.1, kLab).range_m;
  EXPECT_NEAR((farther_m - nearer_m) / 2, 0.032, 0.0005);
}

TEST(RangeFromDisparity, NotFiniteIsImpossibleAndBadGeometryIsNamed) {
  for (const double bad : {kNaN, kInf, -kInf}) {
    EXPECT_EQ(range_from_disparity(bad, 0.1, kLab).verdict, RangeVerdict::kImpossible) << bad;
  }
  EXPECT_EQ(range_from_disparity(5e-324, 1e-300, kLab).verdict, RangeVerdict::kBeyondLimit);
  for (const double bad : {0.0, -0.1, kNaN, kInf}) {
    const std::string text = testing_support::error_of<std::invalid_argument>(
        [bad] { (void)range_from_disparity(80, bad, {.focal_length_px = bad, .mirror_separation_m = 0.3}); });
    for (const char* field : {"focal_length_px", "lens_to_tip_m", "rim_radius_px", "sigma_px"}) {
      EXPECT_NE(text.find(field), std::string::npos) << text;
    }
    EXPECT_EQ(text.find("mirror_separation_m"), std::string::npos) << text;
  }
}

TEST(NearTopPoint, IsTheRimsNearestToTheViewsAxis) {
  MirrorViewSettings s = lab_view(0.25);
  s.axis_offset_m = {0.3, -0.2};
  const MirrorView view(s);
  const Eigen::Vector2d p_BL_m(1.7, 0.9);
  const Eigen::Vector3d near_m = near_top_point(view, p_BL_m, 0.15, 0.9).value();
  double least_m = kInf;
  for (int i = 0; i < 3600; ++i) {
    const Eigen::Vector2d q =
        p_BL_m + 0.15 * Eigen::Vector2d(std::cos(i * std::numbers::pi / 1800), std::sin(i * std::numbers::pi / 1800));
    least_m = std::min(least_m, (q - s.axis_offset_m).norm());
  }
  EXPECT_NEAR((near_m.head<2>() - s.axis_offset_m).norm(), least_m, 1e-6);
  EXPECT_NEAR((near_m.head<2>() - p_BL_m).norm(), 0.15, 1e-15);
  EXPECT_EQ(near_m.z(), 0.9);
  EXPECT_FALSE(near_top_point(view, {0.35, -0.2}, 0.15, 0.9)) << "the axis lies within";
  EXPECT_FALSE(near_top_point(view, {kNaN, 1}, 0.15, 0.9));
  EXPECT_FALSE(near_top_point(view, {1, 1}, kNaN, 0.9));
  EXPECT_FALSE(near_top_point(view, {1, 1}, 0.15, kInf));
}

struct RigCase {
  const char* name;
  Rig rig;
  friend void PrintTo(const RigCase& one, std::ostream* out) { *out << one.name; }
};
class TriangulateTest : public testing::TestWithParam<RigCase> {};
INSTANTIATE_TEST_SUITE_P(Rigs, TriangulateTest, testing::Values(RigCase{"Lab", lab_rig()}, RigCase{"Odd", odd_rig()}),
                         [](const auto& one) { return std::string(one.param.name); });

TEST_P(TriangulateTest, ExactSightingsGiveTheExactPlace) {
  // A pixel's rounding, 1e-13 px in some hundred roundings, times (range + d)^2 / (v s), at most 0.15 m per px up to 5
  // m, times 10 where the upper view's height of the top over its tip divides instead of s.
  constexpr double kRounding_m = 1e-10;
  const Rig& rig = GetParam().rig;
  std::mt19937_64 random(20091);
  std::uniform_real_distribution<double> range(2.1, 5);
  std::uniform_real_distribution<double> bearing(-std::numbers::pi, std::numbers::pi);
  for (int i = 0; i < 2000; ++i) {
    const double range_m = range(random);
    const double bearing_rad = bearing(random);
    const Sighting lower = sighting_of(rig.lower, place(range_m, bearing_rad), 0.1);
    const Sighting upper = sighting_of(rig.upper, place(range_m, bearing_rad), 0.2);
    const auto check = [&](const Triangulation& t, RangeVerdict verdict, int degrees_of_freedom) {
      ASSERT_EQ(t.verdict, verdict) << to_string(t.verdict) << " at " << range_m << " m, " << bearing_rad << " rad";
      EXPECT_NEAR(*t.range_m, range_m, kRounding_m) << "case " << i;
      EXPECT_NEAR(apart(*t.bearing_rad, bearing_rad), 0, kRounding_m) << "case " << i;
      EXPECT_NEAR(*t.top_m, kTop_m, kRounding_m) << "case " << i;
      EXPECT_EQ(t.degrees_of_freedom, degrees_of_freedom);
      EXPECT_LT(t.chi_squared, 1e-12);
    };
    check(triangulate(rig, &lower, &upper, kRadius_m, kTop_m), RangeVerdict::kOk, 2);
    check(triangulate(rig, &lower, &upper, kRadius_m, std::nullopt), RangeVerdict::kOk, 1);
    check(triangulate(rig, &lower, nullptr, kRadius_m, kTop_m), RangeVerdict::kOneView, 0);
    check(triangulate(rig, nullptr, &upper, kRadius_m, kTop_m), RangeVerdict::kOneView, 0);
    if (HasFatalFailure()) return;
  }
}

/// The means of e e^T and of e^T C^-1 e over noisy sightings.
struct Spread {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  double mahalanobis = 0;
  double chi_squared = 0;
  Eigen::Matrix2d stated = Eigen::Matrix2d::Zero();
};

Spread monte_carlo(const Rig& rig, double range_m, double bearing_rad, bool has_lower, bool has_upper,
                   std::optional<double> top_m, int draws) {
  constexpr double kSigma_px = 0.05;
  const Sighting lower = sighting_of(rig.lower, place(range_m, bearing_rad), kSigma_px);
  const Sighting upper = sighting_of(rig.upper, place(range_m, bearing_rad), 1.4 * kSigma_px);
  std::mt19937_64 random(20092);
  std::normal_distribution<double> normal;
  const auto noisy = [&](Sighting s) {
    const Eigen::Matrix2d root = Eigen::LLT<Eigen::Matrix2d>(s.covariance_px2).matrixL();
    const double first = normal(random);
    s.pixel_px += root * Eigen::Vector2d(first, normal(random));
    return s;
  };
  Spread spread;
  for (int i = 0; i < draws; ++i) {
    const Sighting l = noisy(lower);
    const Sighting u = noisy(upper);
    const Triangulation t = triangulate(rig, has_lower ? &l : nullptr, has_upper ? &u : nullptr, kRadius_m, top_m);
    if (!t.range_m) {
      ADD_FAILURE() << "draw " << i << ": " << to_string(t.verdict);
      return spread;
    }
    const Eigen::Vector2d error(*t.range_m - range_m, apart(*t.bearing_rad, bearing_rad));
    spread.mean += error / draws;
    spread.covariance += error * error.transpose() / draws;
    spread.mahalanobis += error.dot(t.covariance->inverse() * error) / draws;
    spread.chi_squared += t.chi_squared / draws;
    spread.stated += *t.covariance / draws;
  }
  return spread;
}

TEST_P(TriangulateTest, MonteCarloAgreesWithTheStatedCovariance) {
  // The mean of n squares of normal numbers has a relative sigma of sqrt(2 / n); five sigmas are allowed. The second
  // order of the range in the noise, sigma / range, is below 1e-2 and enters squared.
  constexpr int kDraws = 2500;
  const double tolerance = 5 * std::sqrt(2.0 / kDraws);
  struct Case {
    const char* name;
    bool has_lower, has_upper;
    std::optional<double> top_m;
    double degrees_of_freedom;
  };
  for (const Case& c : {Case{"both views, known top", true, true, kTop_m, 2},
                        {"unknown top", true, true, {}, 1},
                        {"lower view", true, false, kTop_m, 0},
                        {"upper view", false, true, kTop_m, 0}}) {
    const Spread s = monte_carlo(GetParam().rig, 3.317, 2.211, c.has_lower, c.has_upper, c.top_m, kDraws);
    EXPECT_NEAR(s.covariance(0, 0) / s.stated(0, 0), 1, tolerance) << c.name << ", range";
    EXPECT_NEAR(s.covariance(1, 1) / s.stated(1, 1), 1, tolerance) << c.name << ", bearing";
    const double scale = std::sqrt(s.stated(0, 0) * s.stated(1, 1));
    EXPECT_NEAR(s.covariance(0, 1) / scale, s.stated(0, 1) / scale, tolerance) << c.name << ", correlation";
    EXPECT_NEAR(s.mahalanobis, 2, 2 * 5 / std::sqrt(kDraws)) << c.name;  // chi-squared, 2 degrees: sigma 2
    EXPECT_NEAR(s.chi_squared, c.degrees_of_freedom, 5 * std::sqrt(2 * c.degrees_of_freedom / kDraws) + 1e-12)
        << c.name;
    const double sigma_range_m = std::sqrt(s.stated(0, 0));
    EXPECT_LT(std::abs(s.mean[0]), 5 * sigma_range_m / std::sqrt(kDraws) + sigma_range_m * sigma_range_m) << c.name;
  }
}

TEST(Triangulate, UprightSigmasAreThoseOfTheFormulas) {
  const Rig rig = lab_rig();
  const double range_m = 2.9;
  const double from_v_m = range_m - kRadius_m + 0.12;
  Sighting lower = sighting_of(rig.lower, place(range_m, 0.7), 1);
  Sighting upper = sighting_of(rig.upper, place(range_m, 0.7), 1);
  lower.covariance_px2 = upper.covariance_px2 = Eigen::Matrix2d::Identity() * 0.01;
  const auto sigma_m = [](const Triangulation& t) { return std::sqrt((*t.covariance)(0, 0)); };
  const double of_lower_m = from_v_m * from_v_m * 0.1 / (708 * (kTop_m - 0.37));
  const double of_upper_m = from_v_m * from_v_m * 0.1 / (708 * (kTop_m - 0.67));
  const double of_disparity_m = from_v_m * from_v_m * 0.1 * std::numbers::sqrt2 / 212.4;
  const double of_both_m = 1 / std::hypot(1 / of_lower_m, 1 / of_upper_m);
  EXPECT_NEAR(sigma_m(triangulate(rig, &lower, nullptr, kRadius_m, kTop_m)) / of_lower_m, 1, 1e-9);
  EXPECT_NEAR(sigma_m(triangulate(rig, nullptr, &upper, kRadius_m, kTop_m)) / of_upper_m, 1, 1e-9);
  EXPECT_NEAR(sigma_m(triangulate(rig, &lower, &upper, kRadius_m, std::nullopt)) / of_disparity_m, 1, 1e-9);
  EXPECT_NEAR(sigma_m(triangulate(rig, &lower, &upper, kRadius_m, kTop_m)) / of_both_m, 1, 1e-9);
  const Triangulation t = triangulate(rig, &lower, &upper, kRadius_m, kTop_m);
  EXPECT_NEAR(*t.disparity_px, 212.4 / from_v_m, 1e-10);
  // The near point has the landmark's bearing, and a pixel's error turns it by that over the image radius.
  const double lower_radius_px = 708 * (kTop_m - 0.37) / from_v_m;
  const double upper_radius_px = 708 * (kTop_m - 0.67) / from_v_m;
  const double sigma_bearing_rad = 0.1 / std::hypot(lower_radius_px, upper_radius_px);
  EXPECT_NEAR(std::sqrt((*t.covariance)(1, 1)) / sigma_bearing_rad, 1, 1e-9);
}

TEST(Triangulate, NothingSeenOrOneViewOfAnUnknownTopIsNotSeen) {
  const Rig rig = lab_rig();
  const Sighting lower = sighting_of(rig.lower, {2, 1}, 0.1);
  for (const Triangulation& t : {triangulate(rig, nullptr, nullptr, kRadius_m, kTop_m),
                                 triangulate(rig, &lower, nullptr, kRadius_m, std::nullopt)}) {
    EXPECT_EQ(t.verdict, RangeVerdict::kNotSeen);
    EXPECT_FALSE(t.range_m || t.bearing_rad || t.covariance || t.disparity_px);
  }
}

TEST(Triangulate, ParallelRaysOfAnUnknownTopAreBeyondTheLimitWithTheirBearing) {
  const Rig rig = lab_rig();
  Sighting lower = sighting_of(rig.lower, place(2.5, 0.6), 0.1);
  for (const double disparity_px : {0.0, -0.3, 1e-9, 0.2, -50.0}) {
    Sighting upper = lower;
    upper.pixel_px -= (lower.pixel_px - rig.lower.settings().centre_px).normalized() * disparity_px;
    const Triangulation t = triangulate(rig, &lower, &upper, kRadius_m, std::nullopt);
    EXPECT_EQ(t.verdict, RangeVerdict::kBeyondLimit) << disparity_px << " px: " << to_string(t.verdict);
    EXPECT_NEAR(*t.disparity_px, disparity_px, 1e-11);
    EXPECT_NEAR(t.bearing_rad.value_or(kNaN), 0.6, 1e-9) << disparity_px << " px";
    EXPECT_FALSE(t.range_m || t.covariance || t.top_m) << disparity_px << " px";
  }
}

TEST(Triangulate, AKnownTopAtTheLevelOfTheTipGivesNoRange) {
  // At that height every range appears at the same radius, close to 0.
  const Rig rig = lab_rig();
  const double top_m = 0.37 + 1e-4;
  const Sighting lower = sighting_of(rig.lower, place(2.5, 0.6), 0.1, top_m);
  const Triangulation t = triangulate(rig, &lower, nullptr, kRadius_m, top_m);
  EXPECT_EQ(t.verdict, RangeVerdict::kBeyondLimit) << to_string(t.verdict);
  EXPECT_FALSE(t.range_m);
}

TEST(Triangulate, ViewsThatContradictEachOtherAreInconsistent) {
  const Rig rig = odd_rig();
  const Eigen::Vector2d p = place(2.5, 0.6);
  const Sighting lower = sighting_of(rig.lower, p, 0.1);
  const struct {
    const char* name;
    Sighting upper;
  } cases[] = {{"another bearing", sighting_of(rig.upper, place(2.5, 0.7), 0.1)},
               {"another range", sighting_of(rig.upper, place(2.8, 0.6), 0.1)},
               {"behind", sighting_of(rig.upper, place(2.5, 0.6 - std::numbers::pi + 0.01), 0.1)}};
  for (const auto& [name, upper] : cases) {
    const Triangulation t = triangulate(rig, &lower, &upper, kRadius_m, kTop_m);
    EXPECT_EQ(t.verdict, RangeVerdict::kInconsistent) << name << ": " << to_string(t.verdict);
    EXPECT_FALSE(t.range_m || t.covariance || t.bearing_rad) << name;
    EXPECT_TRUE(t.disparity_px) << name;
  }
  const Triangulation t = triangulate(rig, &lower, &cases[0].upper, kRadius_m, std::nullopt);
  EXPECT_EQ(t.verdict, RangeVerdict::kInconsistent) << "the bearings contradict each other whatever the height";
}

// Catches a bearing between two that exclude each other, where the disparity gives no range.
TEST(Triangulate, BearingsThatContradictEachOtherAreInconsistentAtAnyDisparity) {
  const Rig rig = lab_rig();
  const Eigen::Vector2d centre = rig.lower.settings().centre_px;
  const auto at = [&](double radius_px, double turn_rad) {
    Sighting sighting;
    sighting.pixel_px = centre + radius_px * Eigen::Vector2d(std::cos(turn_rad), std::sin(turn_rad));
    sighting.covariance_px2 = 0.01 * Eigen::Matrix2d::Identity();
    return sighting;
  };
  const Sighting upper = at(100, 0.3);
  for (const double disparity_px : {-50.0, -0.3, 0.0, 1e-9, 0.01, 0.2, 10.0, 50.0}) {
    for (const double turn_rad : {0.02, 0.3, std::numbers::pi / 2, 2.2, 3.0, std::numbers::pi, 4.0}) {
      const Sighting lower = at(100 + disparity_px, 0.3 + turn_rad);
      const Triangulation t = triangulate(rig, &lower, &upper, kRadius_m, std::nullopt);
      EXPECT_EQ(t.verdict, RangeVerdict::kInconsistent)
          << disparity_px << " px, " << turn_rad << " rad: " << to_string(t.verdict);
      EXPECT_FALSE(t.bearing_rad || t.range_m || t.covariance || t.top_m) << disparity_px << " px, " << turn_rad;
      EXPECT_EQ(t.degrees_of_freedom, 1);
      EXPECT_TRUE(t.disparity_px);
    }
  }
  // Without a range the limit is that of the bearings alone: sigma over radius in each view.
  const double limit_rad = 4.891638475699 * 0.1 * std::hypot(1 / 99.0, 1 / 100.0);
  for (const double factor : {0.99, 1.01}) {
    const Sighting lower = at(99, 0.3 + factor * limit_rad);
    const Triangulation t = triangulate(rig, &lower, &upper, kRadius_m, std::nullopt);
    EXPECT_EQ(t.verdict, factor < 1 ? RangeVerdict::kBeyondLimit : RangeVerdict::kInconsistent) << t.chi_squared;
    EXPECT_EQ(t.bearing_rad.has_value(), factor < 1);
  }
}

TEST(Triangulate, TheLimitOfContradictionIsTheStatedQuantile) {
  // One degree of freedom: with the height unknown, only the two bearings can contradict each other.
  const double z = 4.891638475699;
  EXPECT_NEAR(std::erfc(z / std::numbers::sqrt2) / 1e-6, 1, 1e-9);
  const Rig rig = lab_rig();
  const Eigen::Vector2d p = place(2.5, 0.6);
  Sighting lower = sighting_of(rig.lower, p, 0.1);
  Sighting upper = sighting_of(rig.upper, p, 0.1);
  const double sigma_px = 0.1;
  lower.covariance_px2 = Eigen::Matrix2d::Identity() * sigma_px * sigma_px;
  upper.covariance_px2 = lower.covariance_px2;
  const double lower_radius_px = (lower.pixel_px - rig.lower.settings().centre_px).norm();
  const Eigen::Vector2d upper_offset = upper.pixel_px - rig.upper.settings().centre_px;
  // A turn by t leaves chi-squared t^2 / (sigma^2 / h_l^2 + sigma^2 / h_u^2).
  const double sigma_turn_rad = sigma_px * std::hypot(1 / lower_radius_px, 1 / upper_offset.norm());
  for (const double factor : {0.99, 1.01}) {
    const double turn = factor * z * sigma_turn_rad;
    Sighting turned = upper;
    turned.pixel_px = rig.upper.settings().centre_px + Eigen::Rotation2Dd(turn) * upper_offset;
    const Triangulation t = triangulate(rig, &lower, &turned, kRadius_m, std::nullopt);
    EXPECT_EQ(t.verdict, factor < 1 ? RangeVerdict::kOk : RangeVerdict::kInconsistent) << t.chi_squared;
    EXPECT_NEAR(t.chi_squared, factor * factor * z * z, 1e-3 * z * z);
  }
  // Two degrees of freedom: 1 - exp(-x / 2).
  EXPECT_NEAR(std::exp(-27.63102111593 / 2), 1e-6, 1e-16);
}

TEST(Triangulate, WhatNoPlaceShowsIsImpossible) {
  const Rig rig = lab_rig();
  Sighting lower = sighting_of(rig.lower, place(2.5, 0.6), 0.1);
  const Sighting upper = sighting_of(rig.upper, place(2.5, 0.6), 0.1);
  const Eigen::Vector2d centre = rig.lower.settings().centre_px;
  for (const Eigen::Vector2d& bad : {Eigen::Vector2d(kNaN, 1), Eigen::Vector2d(1, kInf), centre,
                                     Eigen::Vector2d(centre + Eigen::Vector2d(2000, 0)),  // R6's radius
                                     Eigen::Vector2d(centre + Eigen::Vector2d(0, 236.6))}) {
    lower.pixel_px = bad;
    for (const auto& top_m : {std::optional(kTop_m), std::optional<double>()}) {
      const Triangulation t = triangulate(rig, &lower, &upper, kRadius_m, top_m);
      EXPECT_EQ(t.verdict, RangeVerdict::kImpossible) << bad.transpose() << ": " << to_string(t.verdict);
      EXPECT_FALSE(t.range_m || t.covariance) << bad.transpose();
    }
  }
  lower = sighting_of(rig.lower, place(2.5, 0.6), 0.1);
  EXPECT_EQ(triangulate(rig, &lower, nullptr, kRadius_m, 0.2).verdict, RangeVerdict::kImpossible)
      << "a ray that rises does not meet a top below the mirror";
}

TEST(Triangulate, ASightingThatNoisePutsOutsideTheRimIsStillUsed) {
  const Rig rig = lab_rig();
  Sighting lower = sighting_of(rig.lower, place(2.5, 0.6), 0.1);
  const Eigen::Vector2d centre = rig.lower.settings().centre_px;
  lower.pixel_px = centre + Eigen::Vector2d(236.1, 0);  // one sigma
  const Triangulation t = triangulate(rig, &lower, nullptr, kRadius_m, kTop_m);
  ASSERT_EQ(t.verdict, RangeVerdict::kOneView) << to_string(t.verdict);
  EXPECT_NEAR(*t.range_m, 708 * (kTop_m - 0.37) / 236.1 - 0.12 + kRadius_m, 1e-12);
}

TEST(Triangulate, SigmasOfVeryUnequalSizeAreNoTrouble) {
  const Rig rig = odd_rig();
  for (const double tiny_px : {1e-9, 1e-6, 1e-3}) {
    const Sighting lower = sighting_of(rig.lower, place(3.1, -2.1), tiny_px);
    const Sighting upper = sighting_of(rig.upper, place(3.1, -2.1), 10);
    const Triangulation t = triangulate(rig, &lower, &upper, kRadius_m, kTop_m);
    ASSERT_EQ(t.verdict, RangeVerdict::kOk) << tiny_px << " px: " << to_string(t.verdict);
    EXPECT_NEAR(*t.range_m, 3.1, 1e-10) << tiny_px << " px";
  }
}

TEST(Triangulate, RefusesWhatIsNoLandmarkAndNoCovariance) {
  const Rig rig = lab_rig();
  const Sighting good = sighting_of(rig.lower, place(2.5, 0.6), 0.1);
  for (const double bad : {0.0, -0.1, kNaN, kInf}) {
    EXPECT_THROW((void)triangulate(rig, &good, nullptr, bad, kTop_m), std::invalid_argument) << bad;
  }
  EXPECT_THROW((void)triangulate(rig, &good, nullptr, kRadius_m, kNaN), std::invalid_argument);
  Eigen::Matrix2d flat;
  flat << 1, 2, 2, 4;
  Eigen::Matrix2d askew;
  askew << 1, 0.5, -0.5, 1;
  for (const Eigen::Matrix2d& c :
       {flat, askew, Eigen::Matrix2d(-Eigen::Matrix2d::Identity()), Eigen::Matrix2d(Eigen::Matrix2d::Zero()),
        Eigen::Matrix2d(Eigen::Matrix2d::Constant(kNaN))}) {
    Sighting bad = good;
    bad.covariance_px2 = c;
    EXPECT_THROW((void)triangulate(rig, &bad, nullptr, kRadius_m, kTop_m), std::invalid_argument) << c;
    EXPECT_THROW((void)triangulate(rig, nullptr, &bad, kRadius_m, kTop_m), std::invalid_argument) << c;
  }
}

}  // namespace
}  // namespace twocone::vision

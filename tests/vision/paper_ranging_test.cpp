// SPDX-License-Identifier: Apache-2.0
#include "vision/paper_ranging.h"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/error_of.h"
#include "tests/vision/lab_rig.h"

namespace twocone::vision {
namespace {

using twocone::testing_support::error_of;

const cv::Scalar kWall(170, 170, 165);

struct PaintedLandmark {
  double distance_m;  // to the axis
  double bearing_rad;
  double top_m = 0.9;
  double radius_m = 0.1;
};

/// Paints one upright cylinder as a pixel-exact camera would see it: each pixel's ray, by the inverse projection, meets
/// the cylinder or not. It is independent of the search under test.
void paint(cv::Mat& image, const MirrorView& view, const PaintedLandmark& landmark, const cv::Vec3b& colour) {
  const Solid solid{place(landmark.distance_m, landmark.bearing_rad), landmark.radius_m, landmark.top_m};
  // Only the strip from the tip to the rim near its bearing can show it.
  const Eigen::Vector2d tip = view.settings().centre_px;
  const Eigen::Vector2d rim = tip + view.offset_px(landmark.bearing_rad, view.settings().rim_radius_px);
  constexpr int kHalfWidth_px = 40;  // of the strip; the widest landmark here spans 30 px
  const cv::Rect strip =
      cv::Rect(
          cv::Point(int(std::min(tip.x(), rim.x())) - kHalfWidth_px, int(std::min(tip.y(), rim.y())) - kHalfWidth_px),
          cv::Point(int(std::max(tip.x(), rim.x())) + kHalfWidth_px, int(std::max(tip.y(), rim.y())) + kHalfWidth_px)) &
      cv::Rect({0, 0}, image.size());
  for (int row = strip.y; row < strip.br().y; ++row) {
    for (int column = strip.x; column < strip.br().x; ++column) {
      const auto ray = view.back_project({column, row});
      if (ray && solid.hit_height_m(*ray)) image.at<cv::Vec3b>(row, column) = colour;
    }
  }
}

const std::vector<Landmark> kRed = {{.name = "red", .colour = {1, 0, 0}, .radius_m = 0.1}};

std::vector<RangeMeasurement> measure(const Rig& rig, const std::vector<PaintedLandmark>& landmarks) {
  cv::Mat lower(kImage, CV_8UC3, kWall);
  cv::Mat upper(kImage, CV_8UC3, kWall);
  for (const PaintedLandmark& landmark : landmarks) {
    paint(lower, rig.lower, landmark, {200, 20, 20});
    paint(upper, rig.upper, landmark, {200, 20, 20});
  }
  return PaperRanging(rig, kRed, kImage, kImage).measure(lower, upper);
}

// Each match is a pixel's centre within one pixel of the edge, so the disparity is off by less than one pixel; an error
// of one pixel sideways adds less than 1 / (2 * 60) px at these distances.
constexpr double kDisparityError_px = 1.02;

TEST(PaperRanging, ErrsByLessThanAPixelOfDisparity) {
  const Rig rig = lab_rig();
  for (const double distance_m : {1.63, 1.97, 2.41, 2.93, 3.37, 4.19, 4.83}) {
    for (const double bearing_rad : {-2.91, 0.11, 0.77, 1.9}) {
      const auto m = measure(rig, {{distance_m, bearing_rad}}).front();
      ASSERT_EQ(m.verdict, RangeVerdict::kOk) << distance_m << " m at " << bearing_rad;
      const double reach_m = distance_m - 0.1 + 0.12;
      const double bound_m =
          reach_m * reach_m / (708 * 0.3) * kDisparityError_px * 1.1;  // 1.1: the curve's second order
      EXPECT_NEAR(*m.range_m, distance_m, bound_m) << "bearing " << bearing_rad;
      // The match is a pixel of the landmark.
      const double radius_px = (*m.lower_px - rig.lower.settings().centre_px).norm();
      EXPECT_LT(std::abs(std::remainder(*m.bearing_rad - bearing_rad, 2 * std::numbers::pi)),
                std::asin(0.1 / distance_m) + 0.5 / radius_px);
      EXPECT_FALSE(m.sigma_range_m);
    }
  }
}

TEST(PaperRanging, IsEquationOnePlusTheRadius) {
  const Rig rig = lab_rig();
  const auto m = measure(rig, {{2.41, 0.77}}).front();
  ASSERT_EQ(m.verdict, RangeVerdict::kOk);
  EXPECT_DOUBLE_EQ(*m.disparity_px, (*m.lower_px - *m.upper_px).norm());
  EXPECT_NEAR(*m.range_m, 708 * 0.3 / *m.disparity_px - 0.12 + 0.1, 1e-13);
}

TEST(PaperRanging, HardCaseR1) {
  // A disparity of 81.06870229007633 px is 2500 mm to the near edge: the nearest whole-pixel distance is within half a
  // pixel.
  const auto m = measure(lab_rig(), {{2.6, 0.0}}).front();
  ASSERT_EQ(m.verdict, RangeVerdict::kOk);
  EXPECT_NEAR(*m.disparity_px, 81.06870229007633, kDisparityError_px);
}

TEST(PaperRanging, SaysWhyThereIsNoRange) {
  const Rig rig = lab_rig();
  EXPECT_EQ(measure(rig, {}).front().verdict, RangeVerdict::kNotSeen);
  EXPECT_EQ(measure(rig, {{1.2, 0.4}}).front().verdict, RangeVerdict::kTruncated);
  EXPECT_EQ(measure(rig, {{2.5, 0.4, 0.6}}).front().verdict, RangeVerdict::kNoMatch);  // its top is below the upper tip
}

TEST(PaperRanging, RefusesToChooseBetweenLandmarksOfOneColour) {
  const std::vector<Landmark> twins = {{.name = "a", .colour = {1, 0, 0}, .radius_m = 0.1},
                                       {.name = "b", .colour = {1, 0.05, 0}, .radius_m = 0.1}};
  const cv::Mat blank(kImage, CV_8UC3, kWall);
  for (const auto& m : PaperRanging(lab_rig(), twins, kImage, kImage).measure(blank, blank)) {
    EXPECT_EQ(m.verdict, RangeVerdict::kSameColour);
  }
}

TEST(PaperRanging, EqualViewsHaveNoDisparity) {
  const Rig rig = lab_rig();
  cv::Mat lower(kImage, CV_8UC3, kWall);
  paint(lower, rig.lower, {2.5, 0.4}, {200, 20, 20});
  const auto m = PaperRanging(rig, kRed, kImage, kImage).measure(lower, lower).front();
  EXPECT_EQ(m.verdict, RangeVerdict::kBeyondLimit);
  EXPECT_FALSE(m.range_m);
}

TEST(PaperRanging, ViewsMayDifferInCentreScaleAndAzimuth) {
  MirrorViewSettings above = lab_view(0.55);
  above.centre_px = {331.2, 228.9};
  above.rim_radius_px = 221;
  above.azimuth_rad = 0.61;
  above.mirrored = true;
  const Rig rig{MirrorView(lab_view(0.25)), MirrorView(above)};
  const auto m = measure(rig, {{2.41, 1.31}}).front();
  ASSERT_EQ(m.verdict, RangeVerdict::kOk);
  // The upper pixel is 236 / 221 times coarser, and the view's centre is not a pixel's centre: another half pixel.
  EXPECT_NEAR(*m.range_m, 2.41, 2.43 * 2.43 / (708 * 0.3) * (kDisparityError_px + 0.5) * 1.1);
}

TEST(PaperRanging, ARunThatCrossesTheImagesXAxisIsOne) {
  const auto m = measure(lab_rig(), {{1.7, 0.0}}).front();
  ASSERT_EQ(m.verdict, RangeVerdict::kOk);
  EXPECT_LT(std::abs(*m.bearing_rad), 1.5 / 200);
}

TEST(PaperRanging, RefusesARigThatTheEquationsDoNotHoldFor) {
  MirrorViewSettings wide = lab_view(0.25);
  wide.cone.apex_rad = 2.1;
  const Rig wrong_apex{MirrorView(wide), MirrorView(lab_view(0.55))};
  EXPECT_THROW(PaperRanging(wrong_apex, kRed, kImage, kImage), std::invalid_argument);
  MirrorViewSettings large = lab_view(0.55);
  large.cone.rim_radius_m = 0.07;
  const Rig two_sizes{MirrorView(lab_view(0.25)), MirrorView(large)};
  EXPECT_THROW(PaperRanging(two_sizes, kRed, kImage, kImage), std::invalid_argument);
  const Rig upside_down{MirrorView(lab_view(0.55)), MirrorView(lab_view(0.25))};
  EXPECT_THROW(PaperRanging(upside_down, kRed, kImage, kImage), std::invalid_argument);
  EXPECT_THROW(PaperRanging(lab_rig(), kRed, {-4, 480}, kImage), std::invalid_argument);
  EXPECT_THROW(PaperRanging(lab_rig(), kRed, kImage, {640, 0}), std::invalid_argument);
}

TEST(PaperRanging, RefusesTiltOffsetAndLensInPlainWords) {
  MirrorViewSettings tilted = lab_view(0.25);
  tilted.tilt_rad = {0, 0.01};
  MirrorViewSettings aside = lab_view(0.55);
  aside.axis_offset_m = {0.002, 0};
  aside.distortion = {{0.1, 0, 0, 0}, {700, 700}, {320, 240}};
  const Rig moved{MirrorView(tilted), MirrorView(aside)};
  EXPECT_EQ(error_of<std::invalid_argument>([&] { PaperRanging(moved, kRed, kImage, kImage); }),
            "method paper: the lower mirror's tilt_rad is [0, 0.01], equation 1 holds for upright mirrors only; the "
            "upper mirror's axis_offset_m is [0.002, 0], equation 1 has both mirrors on one axis; the upper view "
            "has a lens distortion, equation 1 holds for pinhole cameras only;");
  aside.axis_offset_m.setZero();
  aside.distortion->coefficients = {0, 0, 0, 0, 0};
  EXPECT_NO_THROW(PaperRanging({MirrorView(lab_view(0.25)), MirrorView(aside)}, kRed, kImage, kImage));
}

TEST(PaperRanging, RefusesImagesOfAnotherSizeOrType) {
  const PaperRanging ranging(lab_rig(), kRed, kImage, kImage);
  const cv::Mat good(kImage, CV_8UC3, kWall);
  EXPECT_THROW((void)ranging.measure(cv::Mat(480, 641, CV_8UC3), good), std::invalid_argument);
  EXPECT_THROW((void)ranging.measure(good, cv::Mat(kImage, CV_8UC1)), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::vision

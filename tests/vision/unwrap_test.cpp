// SPDX-License-Identifier: Apache-2.0
#include "vision/unwrap.h"

#include <gtest/gtest.h>

#include "tests/vision/lab_rig.h"

namespace twocone::vision {
namespace {

TEST(Unwrap, PutsLeftOnTheLeftAndTheRimOnTop) {
  const MirrorView view(lab_view(0.25));
  cv::Mat image(480, 640, CV_8UC3, cv::Scalar(0, 0, 0));
  const Eigen::Vector2d p = view.settings().centre_px + view.offset_px(1.1, 180);
  cv::Mat block = image(cv::Rect(int(p.x()) - 3, int(p.y()) - 3, 7, 7));
  block.setTo(cv::Scalar(255, 255, 255));

  const cv::Mat unrolled = unwrap(image, view, 720);
  ASSERT_EQ(unrolled.size(), cv::Size(720, 236));
  const int column = int((std::numbers::pi - 1.1) / (2 * std::numbers::pi) * 720);
  EXPECT_LT(column, 360) << "a positive bearing is to the left";
  EXPECT_EQ(unrolled.at<cv::Vec3b>(236 - 180, column)[0], 255);
  EXPECT_EQ(unrolled.at<cv::Vec3b>(236 - 60, column)[0], 0);
  EXPECT_EQ(unrolled.at<cv::Vec3b>(236 - 180, 719 - column)[0], 0);
}

TEST(Unwrap, TakesTheLensOut) {
  MirrorViewSettings s = lab_view(0.25);
  s.distortion = {{-0.3, 0, 0, 0}, {708, 708}, {319.5, 239.5}};
  const MirrorView view(s);
  const Eigen::Vector2d undistorted = s.centre_px + view.offset_px(1.1, 220);
  const Eigen::Vector2d p = view.distort_px(undistorted).value();
  ASSERT_GT((p - undistorted).norm(), 5) << "beyond the block";
  cv::Mat image(480, 640, CV_8UC3, cv::Scalar(0, 0, 0));
  image(cv::Rect(int(p.x()) - 2, int(p.y()) - 2, 5, 5)).setTo(cv::Scalar(255, 255, 255));
  const cv::Mat unrolled = unwrap(image, view, 720);
  const int column = int((std::numbers::pi - 1.1) / (2 * std::numbers::pi) * 720);
  EXPECT_EQ(unrolled.at<cv::Vec3b>(236 - 220, column)[0], 255);
}

TEST(Unwrap, RefusesNothing) {
  const MirrorView view(lab_view(0.25));
  EXPECT_THROW((void)unwrap(cv::Mat(), view, 100), std::invalid_argument);
  EXPECT_THROW((void)unwrap(cv::Mat(10, 10, CV_8UC3), view, 0), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#include "vision/mirror_view.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace twocone::vision {
namespace {

const Eigen::Vector2d kFocal_px(701.3, 698.9);
const Eigen::Vector2d kPrincipal_px(322.7, 243.1);
const std::vector<double> kCoefficients[] = {
    {-0.21, 0.07, 0.0013, -0.0021},
    {-0.21, 0.07, 0.0013, -0.0021, -0.013},
    {0.31, -0.12, 0.0013, -0.0021, 0.017, 0.52, -0.08, 0.023},
};

/// The results of cv::projectPoints of OpenCV 4.6 on (x, y, 1), for the models above in order.
struct Reference {
  Eigen::Vector2d at;
  Eigen::Vector2d pixel[3];
};
const Reference kReferences[] = {
    {{0.31, -0.22},
     {{533.20344328735246, 94.202481983435007},
      {533.19491596999342, 94.208512917978254},
      {533.16478881350645, 94.229820311745186}}},
    {{-0.05, 0.47},
     {{288.77831784660196, 557.99347568420364},
      {288.78340022155311, 557.94586485371519},
      {288.79959090899337, 557.79419322723777}}},
    {{0.6, 0.4},
     {{704.10677383999996, 497.48226728000003},
      {703.33762839487986, 496.97125843776001},
      {701.47222304717138, 495.73191075249599}}},
};

TEST(Lens, AgreesWithOpenCvBothWays) {
  // Coordinates below 1024 are 1e-13 apart. There are some ten roundings, in OpenCV's order and in ours.
  constexpr double kRounding_px = 2e-12;
  for (const Reference& reference : kReferences) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Lens lens({kCoefficients[i], kFocal_px, kPrincipal_px});
      const Eigen::Vector2d pinhole = kPrincipal_px + kFocal_px.cwiseProduct(reference.at);
      const auto seen = lens.distort(pinhole);
      ASSERT_TRUE(seen);
      EXPECT_LT((*seen - reference.pixel[i]).norm(), kRounding_px) << reference.at.transpose() << ", model " << i;
      const auto back = lens.undistort(reference.pixel[i]);
      ASSERT_TRUE(back);
      EXPECT_LT((*back - pinhole).norm(), 2 * kRounding_px) << reference.at.transpose() << ", model " << i;
    }
  }
}

TEST(Lens, BothWaysMeet) {
  std::mt19937_64 random(20081);
  std::uniform_real_distribution<double> column(-100, 740);
  std::uniform_real_distribution<double> row(-100, 580);
  for (int i = 0; i < 20000; ++i) {
    const Lens lens({kCoefficients[i % 3], kFocal_px, kPrincipal_px});
    const Eigen::Vector2d pinhole(column(random), row(random));
    const auto seen = lens.distort_with_jacobian(pinhole);
    ASSERT_TRUE(seen) << pinhole.transpose();
    const auto back = lens.undistort(seen->pixel_px);
    ASSERT_TRUE(back) << pinhole.transpose();
    // Roundings of 1e-13, amplified by the inverse of the Jacobian, whose least singular value is above 0.6 here.
    EXPECT_LT((*back - pinhole).norm(), 2e-12) << pinhole.transpose() << ", model " << i % 3;
  }
}

TEST(Lens, TheJacobianIsThatOfTheDistortion) {
  constexpr double kStep_px = 0.01;
  // The error is step^2 times a third derivative of some 1e-6 / px^2, and rounding over the step.
  constexpr double kTolerance = 1e-8;
  const Lens lens({kCoefficients[2], kFocal_px, kPrincipal_px});
  const Eigen::Vector2d at(541.3, 88.7);
  const Eigen::Matrix2d jacobian = lens.distort_with_jacobian(at)->jacobian;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d step = kStep_px * Eigen::Vector2d::Unit(k);
    const Eigen::Vector2d slope = (*lens.distort(at + step) - *lens.distort(at - step)) / (2 * kStep_px);
    EXPECT_LT((jacobian.col(k) - slope).norm(), kTolerance) << "column " << k;
  }
}

TEST(Lens, BeyondTheFoldThereIsNothing) {
  // x' = x (1 - x^2 / 4) turns back at x = sqrt(4 / 3), where x' is 0.7698: no point is imaged farther out.
  const Lens barrel({{-0.25, 0, 0, 0}, {100, 100}, {0, 0}});
  const double fold_px = 100 * std::sqrt(4.0 / 3);
  EXPECT_TRUE(barrel.distort({0.999 * fold_px, 0}));
  EXPECT_FALSE(barrel.distort({1.001 * fold_px, 0}));
  EXPECT_NEAR(barrel.undistort({76.9, 0})->x(), 112.4165, 1e-4);  // 1.124165 (1 - 1.124165^2 / 4) = 0.769
  EXPECT_FALSE(barrel.undistort({77.1, 0}));
  EXPECT_FALSE(barrel.undistort({500, 0}));
}

TEST(Lens, AnswersNothingForInputThatIsNotFinite) {
  const Lens lens({kCoefficients[0], kFocal_px, kPrincipal_px});
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(lens.distort({bad, 1})) << bad;
    EXPECT_FALSE(lens.undistort({1, bad})) << bad;
  }
}

}  // namespace
}  // namespace twocone::vision

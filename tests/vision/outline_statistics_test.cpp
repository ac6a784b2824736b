// SPDX-License-Identifier: Apache-2.0
// Checks that the sigmas are true, and the distance to the Cramer-Rao bound: random poses in a room with six landmarks,
// sensor noise of 2 grey levels. TWOCONE_POSES=2000 runs the full test.
#include <cstdio>
#include <cstdlib>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "localisation/least_squares_fix.h"
#include "tests/support/srgb.h"
#include "tests/support/synthetic_lab.h"
#include "tests/vision/lab_rig.h"
#include "vision/bound.h"

namespace twocone::vision {
namespace {

using testing_support::seen_from;
using testing_support::six_landmarks;
using testing_support::SyntheticRig;
using testing_support::SyntheticScene;
using testing_support::targets_of;

constexpr double kNoise_grey = 2;
constexpr double kLevel = 0.45;  // of the background, linear
constexpr double kChi2_2dof_95 = 5.991464547;

int poses() {
  const char* asked = std::getenv("TWOCONE_POSES");
  return asked != nullptr ? std::atoi(asked) : 24;
}

/// The noise of the edge between two colours, in pixels, for each pixel of its length. A box of one pixel carries the
/// information: integral over the coverage c of (d code / d c)^2 / sigma^2, summed over the channels. Rounding adds
/// 1/12 to the variance.
double edge_noise_px(const Eigen::Vector3d& inside, double outside) {
  constexpr int kSteps = 2000;
  double information = 0;
  for (int channel = 0; channel < 3; ++channel) {
    for (int i = 0; i < kSteps; ++i) {
      const auto code = [&](double c) { return testing_support::coded(outside + c * (inside[channel] - outside)); };
      const double slope = (code((i + 1.0) / kSteps) - code(double(i) / kSteps)) * kSteps;
      information += slope * slope / kSteps;
    }
  }
  return std::sqrt((kNoise_grey * kNoise_grey + 1.0 / 12) / information);
}

TEST(OutlineStatistics, EllipsesHoldTheTruthAndTheErrorIsNearTheBound) {
  const SyntheticRig rig(lab_rig(), {.level = kLevel});
  const auto landmarks = six_landmarks();
  const auto targets = targets_of(landmarks);
  const OutlineRanging ranging(rig.rig, targets, kImage, kImage);
  std::vector<Eigen::Vector2d> places;
  for (const auto& p : landmarks) places.push_back(p.centre_m);
  std::mt19937_64 random(20260721);
  std::uniform_real_distribution<double> x(-0.9, 0.9);
  std::uniform_real_distribution<double> y(-0.5, 0.5);
  std::uniform_real_distribution<double> turn(-3.1, 3.1);

  int fixes = 0;
  int inside = 0;
  int heading_inside = 0;
  double squares = 0;
  double bounds = 0;
  const int count = poses();
  for (int i = 0; i < count; ++i) {
    const localisation::Pose pose{x(random), y(random), turn(random)};
    // Light without shading: then the bound can use the landmark's colour at its edge.
    const SyntheticScene scene{seen_from(landmarks, {pose.x_m, pose.y_m}, pose.heading_rad), {}, {1, 0, 0}};
    const auto pair = rig.take(scene, {1, kNoise_grey}, random);
    std::vector<localisation::LandmarkMeasurement> measurements;
    std::vector<Eigen::Matrix2d> information;
    const auto measured = ranging.measure(pair.lower, pair.upper);
    for (std::size_t k = 0; k < measured.size(); ++k) {
      Eigen::Matrix2d both = Eigen::Matrix2d::Zero();
      for (const MirrorView* view : {&rig.rig.lower, &rig.rig.upper}) {
        const auto one = sighting_information(*view, targets[k], scene.landmarks[k].centre_m,
                                              edge_noise_px(scene.landmarks[k].colour, kLevel));
        if (one) both += *one;
      }
      information.push_back(both);
      const RangeMeasurement& m = measured[k];
      if (m.range_m && m.covariance) measurements.push_back({places[k], m.range_m, m.bearing_rad, *m.covariance});
    }
    const auto fix = localisation::fix_by_least_squares(measurements);
    if (fix.verdict != localisation::FixVerdict::kOk) continue;
    ++fixes;
    const Eigen::Vector2d off = *fix.position_m - Eigen::Vector2d(pose.x_m, pose.y_m);
    if (off.dot(fix.covariance->topLeftCorner<2, 2>().inverse() * off) <= kChi2_2dof_95) ++inside;
    const double turned = std::remainder(*fix.heading_rad - pose.heading_rad, 2 * std::numbers::pi);
    if (std::abs(turned) <= 1.959964 * std::sqrt((*fix.covariance)(2, 2))) ++heading_inside;
    squares += off.squaredNorm();
    const auto bound = localisation::pose_bound(pose, places, information);
    ASSERT_TRUE(bound);
    bounds += bound->topLeftCorner<2, 2>().trace();
  }
  const double share = 100.0 * inside / fixes;
  const double heading_share = 100.0 * heading_inside / fixes;
  const double ratio = std::sqrt(squares / bounds);
  std::printf(
      "poses: %d, fixes: %d\nposition in its 95 %% ellipse: %.1f %%\nheading in its 95 %% interval: %.1f %%\n"
      "rmse over the bound: %.2f (%.3f mm against %.3f mm)\n",
      count, fixes, share, heading_share, ratio, 1e3 * std::sqrt(squares / fixes), 1e3 * std::sqrt(bounds / fixes));
  EXPECT_GE(fixes, 0.99 * count);
  // The bound uses the true colours at every edge, and all of an edge's information. For 24 poses the ratio scatters by
  // a sixth.
  EXPECT_LE(ratio, count >= 2000 ? 1.3 : 1.7);
  // For few poses the share itself scatters: allow three standard deviations of it.
  const double slack = count >= 2000 ? 0 : 300 * std::sqrt(0.95 * 0.05 / fixes);
  EXPECT_GE(share, 93 - slack);
  EXPECT_LE(share, 97 + slack);
}

}  // namespace
}  // namespace twocone::vision

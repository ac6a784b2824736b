// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include <gtest/gtest.h>

#include "localisation/pose_filter.h"

namespace twocone::localisation {

inline constexpr WheelGeometry kWheels{0.05, 0.3};
inline constexpr OdometryNoise kNoise{.slip = 0.01, .correlation_s = 2, .angle_rad = 0.003};
inline constexpr double kStep_s = 1 / 15.0;
inline constexpr double kFixSigma_m = 0.001;
inline constexpr double kFixSigma_rad = 0.0005;

inline Fix fix_at(const Pose& pose, const Eigen::Matrix3d& covariance) {
  Fix fix;
  fix.verdict = FixVerdict::kOk;
  fix.position_m = Eigen::Vector2d(pose.x_m, pose.y_m);
  fix.heading_rad = pose.heading_rad;
  fix.covariance = covariance;
  return fix;
}

/// A filter that has started with such a fix, with the wheels at 0.
inline PoseFilter filter_at(const Pose& pose, const Eigen::Matrix3d& covariance, const OdometryNoise& noise = kNoise) {
  PoseFilter filter(kWheels, noise);
  filter.predict(0, 0, 0);
  EXPECT_EQ(filter.correct(fix_at(pose, covariance)), FixUse::kStarted);
  return filter;
}

/// A robot that drives curves, with the slip and readings that the filter assumes. Its arc is cut into short straight
/// pieces, so that it shares nothing with the arc under test.
class Drive {
 public:
  explicit Drive(std::uint64_t seed) : random_(seed) {
    for (double& s : slip_) s = kNoise.slip * normal_(random_);
    read();
  }

  /// Moves one frame on, at wheel speeds that make wide curves to either side.
  Drive& step(double left_radps, double right_radps) {
    t_s_ += kStep_s;
    const double kept = std::exp(-kStep_s / kNoise.correlation_s);
    const double left = left_radps * kStep_s;
    const double right = right_radps * kStep_s;
    constexpr int kPieces = 16;
    for (int i = 0; i < kPieces; ++i) {
      const double left_m = kWheels.radius_m * left / kPieces * (1 + slip_[0]);
      const double right_m = kWheels.radius_m * right / kPieces * (1 + slip_[1]);
      const double turn = (right_m - left_m) / kWheels.separation_m;
      truth_.x_m += (left_m + right_m) / 2 * std::cos(truth_.heading_rad + turn / 2);
      truth_.y_m += (left_m + right_m) / 2 * std::sin(truth_.heading_rad + turn / 2);
      truth_.heading_rad = wrap_angle_rad(truth_.heading_rad + turn);
    }
    wheel_rad_[0] += left;
    wheel_rad_[1] += right;
    for (double& s : slip_) s = kept * s + std::sqrt(1 - kept * kept) * kNoise.slip * normal_(random_);
    read();
    return *this;
  }
  Drive& step() { return step(6 + 2 * std::sin(0.7 * t_s_), 6 + 2 * std::sin(0.9 * t_s_ + 1)); }

  Fix fix() {
    Fix f;
    f.verdict = FixVerdict::kOk;
    f.degrees_of_freedom = 3;  // three landmarks
    f.position_m =
        Eigen::Vector2d(truth_.x_m + kFixSigma_m * normal_(random_), truth_.y_m + kFixSigma_m * normal_(random_));
    f.heading_rad = wrap_angle_rad(truth_.heading_rad + kFixSigma_rad * normal_(random_));
    f.covariance = Eigen::Vector3d(kFixSigma_m * kFixSigma_m, kFixSigma_m * kFixSigma_m, kFixSigma_rad * kFixSigma_rad)
                       .asDiagonal();
    return f;
  }

  template <typename Filter>
  void report_readings(Filter& filter) const {
    filter.predict(t_s_, reading_rad_[0], reading_rad_[1]);
  }
  void carry(const Pose& to) { truth_ = to; }

  [[nodiscard]] const Pose& truth() const { return truth_; }
  [[nodiscard]] double t_s() const { return t_s_; }
  [[nodiscard]] Eigen::Vector3d error(const Pose& p) const {
    return {p.x_m - truth_.x_m, p.y_m - truth_.y_m, wrap_angle_rad(p.heading_rad - truth_.heading_rad)};
  }

 private:
  void read() {
    for (int i = 0; i < 2; ++i) reading_rad_[i] = wheel_rad_[i] + kNoise.angle_rad * normal_(random_);
  }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double t_s_ = 0;
  Pose truth_{0.3, -0.2, 0.4};
  double slip_[2] = {0, 0};
  double wheel_rad_[2] = {0, 0};
  double reading_rad_[2] = {0, 0};
};

}  // namespace twocone::localisation

// SPDX-License-Identifier: Apache-2.0
#include "vision/calibration/wheel_rows.h"

#include <cmath>

#include <Eigen/Cholesky>

namespace twocone::vision::calibration {
namespace {

// Error in every direction from the floor's unevenness and the approximation by arcs: a tenth of a millimetre. Without
// it the covariance of a single arc would be singular across the arc.
constexpr double kFloor_m = 1e-4;

double mean_decay(double x) { return x < 1e-8 ? 1 - x / 2 : -std::expm1(-x) / x; }

/// Covariance of (x, y, heading) at the interval's end relative to its beginning, from errors other than the mean
/// slips: the resolution of the readings at both ends, and slip that changes within the interval, taken as independent
/// for each reading.
Eigen::Matrix3d way_covariance(const WheelRow& row, double duration_s, const WheelBelief& wheels) {
  const double radius = wheels.radius_m;
  std::vector<Eigen::Vector3d> middles;  // pose in the middle of each arc
  Eigen::Vector3d pose = Eigen::Vector3d::Zero();
  for (const Eigen::Vector2d& turns : row.turns_rad) {
    const double way = radius * (turns.x() + turns.y()) / 2;
    const double turn = radius * (turns.y() - turns.x()) / wheels.separation_m;
    const double heading = pose.z() + turn / 2;
    middles.emplace_back(pose.x() + way / 2 * std::cos(heading), pose.y() + way / 2 * std::sin(heading), heading);
    pose += Eigen::Vector3d(way * std::cos(heading), way * std::sin(heading), turn);
  }
  // Within an interval of x time constants, the slip has a variance of x / 3 about its mean (first order in x).
  const double wander = wheels.slip * std::sqrt(std::min(1.0, duration_s / wheels.slip_correlation_s / 3));
  const double step_m = radius * wheels.angle_step_rad / std::sqrt(12.0);  // sigma of one reading: uniform over a step
  Eigen::Matrix3d covariance = Eigen::Vector3d(1, 1, 1 / wheels.separation_m).cwiseAbs2().asDiagonal();
  covariance *= kFloor_m * kFloor_m;
  for (std::size_t i = 0; i < middles.size(); ++i) {
    const double c = std::cos(middles[i].z());
    const double s = std::sin(middles[i].z());
    for (const int wheel : {0, 1}) {
      // Half of the wheel's travel goes forward; the turn rotates the rest of the motion.
      const double turn = (wheel == 1 ? 1 : -1) / wheels.separation_m;
      const Eigen::Vector3d effect(c / 2 - turn * (pose.y() - middles[i].y()),
                                   s / 2 + turn * (pose.x() - middles[i].x()), turn);
      const double sigma_m = wander * radius * row.turns_rad[i][wheel];
      covariance += sigma_m * sigma_m * effect * effect.transpose();
      if (i == 0 || i + 1 == middles.size()) covariance += step_m * step_m * effect * effect.transpose();
    }
  }
  return covariance;
}

}  // namespace

double mean_slip_variance(double x) {
  // The closed form loses 2 digits for each digit by which x is small: below 1e-4 the series is better.
  return x < 1e-4 ? 1 - x / 3 : 2 * (x + std::expm1(-x)) / (x * x);
}

std::vector<WheelRow> wheel_rows(const std::vector<CalibrationFrame>& frames, const WheelBelief& wheels,
                                 bool needs_twists) {
  std::vector<WheelRow> rows;
  double last_x = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const std::vector<WheelReading>& readings = frames[i].wheels;
    if (readings.size() < 2) continue;
    const auto& from_twist = frames[i - 1].twist;
    const auto& to_twist = frames[i].twist;
    if (needs_twists && !(from_twist && to_twist)) continue;
    const double duration_s = readings.back().t_s - readings.front().t_s;
    if (!(duration_s > 0)) continue;
    WheelRow row;
    row.frame = i;
    row.from_twist = from_twist.value_or(BodyTwist{});
    row.to_twist = to_twist.value_or(BodyTwist{});
    for (std::size_t k = 1; k < readings.size(); ++k) {
      row.turns_rad.emplace_back(readings[k].left_rad - readings[k - 1].left_rad,
                                 readings[k].right_rad - readings[k - 1].right_rad);
    }
    const Eigen::Matrix3d factor = way_covariance(row, duration_s, wheels).llt().matrixL();
    row.whitener = factor.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity());
    const double x = duration_s / wheels.slip_correlation_s;
    const double variance = mean_slip_variance(x);
    row.follows = !rows.empty() && rows.back().frame + 1 == i;
    if (row.follows) {
      const double covariance = mean_decay(last_x) * mean_decay(x);
      row.slip_share = covariance / mean_slip_variance(last_x);
      row.slip_sigma = std::sqrt(std::max(1e-6, variance - row.slip_share * covariance));
    } else {
      row.slip_sigma = std::sqrt(variance);
    }
    last_x = x;
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace twocone::vision::calibration

// SPDX-License-Identifier: Apache-2.0
#include "localisation/wheel_step.h"

#include <cmath>

namespace twocone::localisation {
namespace {

/// d sinc(u) / du = (u cos u - sin u) / u^2. Below 0.02 three terms of its series are accurate to 1e-17, where the
/// quotient would lose eps / u by cancellation.
double sinc_slope(double u) {
  if (std::abs(u) < 0.02) return u * (-1 / 3.0 + u * u * (1 / 30.0 - u * u / 840));
  return (u * std::cos(u) - std::sin(u)) / (u * u);
}

}  // namespace

PoseHypothesis::Matrix start_covariance(const OdometryNoise& noise) {
  PoseHypothesis::Matrix covariance = PoseHypothesis::Matrix::Zero();
  covariance(kBendState, kBendState) = 1;
  covariance(kLeftSlip, kLeftSlip) = covariance(kRightSlip, kRightSlip) = noise.slip * noise.slip;
  covariance(kLeftReading, kLeftReading) = covariance(kRightReading, kRightReading) = noise.angle_rad * noise.angle_rad;
  return covariance;
}

WheelStep wheel_step(const PoseHypothesis::Vector& state, const PoseHypothesis::Matrix& covariance, double dt_s,
                     double left_rad, double right_rad, const WheelGeometry& wheels, const OdometryNoise& noise) {
  const double r = wheels.radius_m;
  // A reading is the angle plus its error. The travel is that of the readings' difference, minus the new error
  // (expected value 0) and plus the old one.
  const double left_seen_m = r * (left_rad + state[kLeftReading]);
  const double right_seen_m = r * (right_rad + state[kRightReading]);
  const double left_m = left_seen_m * (1 + state[kLeftSlip]);
  const double right_m = right_seen_m * (1 + state[kRightSlip]);
  const Pose before{state[kX], state[kY], state[kHeading]};
  const Pose after = drive_arc(before, left_m, right_m, wheels.separation_m);

  const double way_m = (left_m + right_m) / 2;
  const double half_turn = (right_m - left_m) / wheels.separation_m / 2;
  const double c = std::cos(before.heading_rad + half_turn);
  const double s = std::sin(before.heading_rad + half_turn);
  const double chord = sinc(half_turn);
  const double slope = sinc_slope(half_turn);
  const Eigen::Vector3d by_way(chord * c, chord * s, 0);
  const Eigen::Vector3d by_turn(way_m * (slope * c - chord * s) / 2, way_m * (slope * s + chord * c) / 2, 1);
  const Eigen::Vector3d by_left_m = by_way / 2 - by_turn / wheels.separation_m;
  const Eigen::Vector3d by_right_m = by_way / 2 + by_turn / wheels.separation_m;

  WheelStep step;
  const double kept = std::exp(-dt_s / noise.correlation_s);
  PoseHypothesis::Matrix& f = step.by_state;
  f.topLeftCorner<3, 3>().setIdentity();
  f(kX, kHeading) = -way_m * chord * s;
  f(kY, kHeading) = way_m * chord * c;
  f.block<3, 1>(0, kLeftSlip) = by_left_m * left_seen_m;
  f.block<3, 1>(0, kRightSlip) = by_right_m * right_seen_m;
  f.block<3, 1>(0, kLeftReading) = by_left_m * r * (1 + state[kLeftSlip]);
  f.block<3, 1>(0, kRightReading) = by_right_m * r * (1 + state[kRightSlip]);
  f(kLeftSlip, kLeftSlip) = f(kRightSlip, kRightSlip) = kept;
  f(kBendState, kBendState) = 1;

  // The new readings' errors enter the pose with the opposite sign of the old ones, and replace them in the state.
  Eigen::Matrix<double, 8, 2>& g = step.by_readings;
  g.block<3, 1>(0, 0) = -f.block<3, 1>(0, kLeftReading);
  g.block<3, 1>(0, 1) = -f.block<3, 1>(0, kRightReading);
  g(kLeftReading, 0) = g(kRightReading, 1) = 1;

  // The heading's variance over the path is taken as the mean of both ends, more than that of an evenly growing error.
  const double reading2 = noise.angle_rad * noise.angle_rad;
  const double heading2 =
      (covariance(kHeading, kHeading) + f.row(kHeading).dot(covariance * f.row(kHeading).transpose()) +
       reading2 * g.row(kHeading).squaredNorm()) /
      2;
  f.block<3, 1>(0, kBendState) = -PoseHypothesis::kBend * heading2 * way_m * by_way;

  // This is 1 - kept^2 without cancellation.
  step.renewed = -std::expm1(-2 * dt_s / noise.correlation_s) * noise.slip * noise.slip;
  step.by_wheels << by_left_m * left_m, by_right_m * right_m, by_turn * (-2 * half_turn / wheels.separation_m);
  step.state << after.x_m, after.y_m, after.heading_rad, kept * state[kLeftSlip], kept * state[kRightSlip], 0, 0,
      state[kBendState];
  step.state.head<3>() += f.block<3, 1>(0, kBendState) * state[kBendState];
  return step;
}

PoseHypothesis::Matrix WheelStep::covariance(const PoseHypothesis::Matrix& before, const OdometryNoise& noise) const {
  const double reading2 = noise.angle_rad * noise.angle_rad;
  PoseHypothesis::Matrix p =
      by_state * before * by_state.transpose() + reading2 * by_readings * by_readings.transpose();
  p(kLeftSlip, kLeftSlip) += renewed;
  p(kRightSlip, kRightSlip) += renewed;
  // Information from fixes on the bend belongs to an earlier heading error, so it is discarded.
  p(kBendState, kBendState) = 1;
  return p;
}

}  // namespace twocone::localisation

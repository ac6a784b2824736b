// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <Eigen/Cholesky>

#include "localisation/chi_squared.h"
#include "localisation/pose_filter.h"

namespace twocone::localisation {
namespace {

// Places in the state.
constexpr int kX = 0;
constexpr int kY = 1;
constexpr int kHeading = 2;
constexpr int kLeftSlip = 3;
constexpr int kRightSlip = 4;
constexpr int kLeftReading = 5;
constexpr int kRightReading = 6;

/// d sinc(u) / du = (u cos u - sin u) / u^2. Below 0.02 three terms of its series are right to 1e-17, where the
/// quotient would lose eps / u of the two that cancel.
double sinc_slope(double u) {
  if (std::abs(u) < 0.02) return u * (-1 / 3.0 + u * u * (1 / 30.0 - u * u / 840));
  return (u * std::cos(u) - std::sin(u)) / (u * u);
}

}  // namespace

PoseHypothesis::PoseHypothesis(const PoseEstimate& start, const OdometryNoise& noise) {
  state_.head<3>() << start.pose.x_m, start.pose.y_m, start.pose.heading_rad;
  covariance_.setZero();
  covariance_.topLeftCorner<3, 3>() = (start.covariance + start.covariance.transpose()) / 2;
  covariance_(kLeftSlip, kLeftSlip) = covariance_(kRightSlip, kRightSlip) = noise.slip * noise.slip;
  covariance_(kLeftReading, kLeftReading) = covariance_(kRightReading, kRightReading) =
      noise.angle_rad * noise.angle_rad;
}

void PoseHypothesis::predict(double dt_s, double left_rad, double right_rad, const WheelGeometry& wheels,
                             const OdometryNoise& noise) {
  const double r = wheels.radius_m;
  // A reading is the angle plus its error: the way is that of the readings' difference, less the new error (0 as far as
  // anybody knows) and plus the old one.
  const double left_seen_m = r * (left_rad + state_[kLeftReading]);
  const double right_seen_m = r * (right_rad + state_[kRightReading]);
  const double left_m = left_seen_m * (1 + state_[kLeftSlip]);
  const double right_m = right_seen_m * (1 + state_[kRightSlip]);
  const Pose before{state_[kX], state_[kY], state_[kHeading]};
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

  const double kept = std::exp(-dt_s / noise.correlation_s);
  Matrix f = Matrix::Zero();
  f.topLeftCorner<3, 3>().setIdentity();
  f(kX, kHeading) = -way_m * chord * s;
  f(kY, kHeading) = way_m * chord * c;
  f.block<3, 1>(0, kLeftSlip) = by_left_m * left_seen_m;
  f.block<3, 1>(0, kRightSlip) = by_right_m * right_seen_m;
  f.block<3, 1>(0, kLeftReading) = by_left_m * r * (1 + state_[kLeftSlip]);
  f.block<3, 1>(0, kRightReading) = by_right_m * r * (1 + state_[kRightSlip]);
  f(kLeftSlip, kLeftSlip) = f(kRightSlip, kRightSlip) = kept;

  // The new readings' errors enter the pose with the sign opposite to the old ones', and become the state's.
  Eigen::Matrix<double, 7, 2> g = Eigen::Matrix<double, 7, 2>::Zero();
  g.block<3, 1>(0, 0) = -f.block<3, 1>(0, kLeftReading);
  g.block<3, 1>(0, 1) = -f.block<3, 1>(0, kRightReading);
  g(kLeftReading, 0) = g(kRightReading, 1) = 1;

  Matrix p = f * covariance_ * f.transpose() + noise.angle_rad * noise.angle_rad * g * g.transpose();
  // 1 - kept^2 without cancellation.
  const double renewed = -std::expm1(-2 * dt_s / noise.correlation_s) * noise.slip * noise.slip;
  p(kLeftSlip, kLeftSlip) += renewed;
  p(kRightSlip, kRightSlip) += renewed;
  covariance_ = (p + p.transpose()) / 2;
  state_ << after.x_m, after.y_m, after.heading_rad, kept * state_[kLeftSlip], kept * state_[kRightSlip], 0, 0;
}

PoseHypothesis::Difference PoseHypothesis::difference(const Measurement& m) const {
  Difference d{Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
  Eigen::Vector3d apart = m.pose - state_.head<3>();
  apart.z() = wrap_angle_rad(apart.z());
  const auto view = m.view.topRows(m.rows);
  d.value.head(m.rows) = view * apart;
  d.covariance.topLeftCorner(m.rows, m.rows) =
      view * (covariance_.topLeftCorner<3, 3>() + m.covariance) * view.transpose();
  return d;
}

bool PoseHypothesis::expects(const Measurement& m) const {
  if (m.rows == 0) return true;
  const Difference d = difference(m);
  const Eigen::LLT<Eigen::Matrix3d> llt(d.covariance);
  if (llt.info() != Eigen::Success) return false;
  return chi_squared_tail(d.value.dot(llt.solve(d.value)), m.rows) >= PoseFilter::kGate;
}

void PoseHypothesis::correct(const Measurement& m) {
  if (m.rows == 0) return;
  const Difference d = difference(m);
  Eigen::Matrix<double, 3, 7> h = Eigen::Matrix<double, 3, 7>::Zero();
  h.topLeftCorner(m.rows, 3) = m.view.topRows(m.rows);
  Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
  r.topLeftCorner(m.rows, m.rows) = m.view.topRows(m.rows) * m.covariance * m.view.topRows(m.rows).transpose();
  const Eigen::Matrix<double, 7, 3> gain = d.covariance.llt().solve(h * covariance_).transpose();
  const Matrix left = Matrix::Identity() - gain * h;
  const Matrix p = left * covariance_ * left.transpose() + gain * r * gain.transpose();
  covariance_ = (p + p.transpose()) / 2;
  state_ += gain * d.value;
  state_[kHeading] = wrap_angle_rad(state_[kHeading]);
}

PoseEstimate PoseHypothesis::estimate() const {
  return {{state_[kX], state_[kY], state_[kHeading]}, covariance_.topLeftCorner<3, 3>()};
}

}  // namespace twocone::localisation

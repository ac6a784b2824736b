// SPDX-License-Identifier: Apache-2.0
#include "localisation/pose_filter.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <Eigen/Geometry>

namespace twocone::localisation {
namespace {

using Measurement = PoseHypothesis::Measurement;

bool is_covariance(const Eigen::Matrix3d& c) { return c.allFinite() && c.diagonal().head<2>().minCoeff() > 0; }

/// Nothing where the fix has no covariance that means something.
std::optional<Measurement> measurement_of(const std::optional<Eigen::Vector2d>& position_m,
                                          const std::optional<double>& heading_rad,
                                          const std::optional<Eigen::Matrix3d>& covariance) {
  if (!position_m || !covariance || !position_m->allFinite() || !is_covariance(*covariance)) return std::nullopt;
  Measurement m;
  m.rows = heading_rad ? 3 : 2;
  if (heading_rad && !(std::isfinite(*heading_rad) && (*covariance)(2, 2) > 0)) return std::nullopt;
  m.pose << *position_m, heading_rad.value_or(0);
  m.covariance = *covariance;
  return m;
}

/// What a weak fix tells: two directions (without heading: one) at right angles to the unseen one. The error along that
/// may be anything, and these rows do not see it.
std::optional<Measurement> measurement_across(const Fix& fix) {
  if (!fix.unseen_direction || !fix.position_m || !fix.covariance || !fix.covariance->allFinite()) return std::nullopt;
  const Eigen::Vector3d& unseen = *fix.unseen_direction;
  Measurement m;
  m.pose << *fix.position_m, fix.heading_rad.value_or(0);
  m.covariance = *fix.covariance;
  m.view.setZero();
  if (!fix.heading_rad) {
    m.rows = 1;
    m.view.row(0) << -unseen.y(), unseen.x(), 0;
    return m;
  }
  m.rows = 2;
  Eigen::Index least = 0;
  unseen.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d first = unseen.cross(Eigen::Vector3d::Unit(least)).normalized();
  m.view.row(0) = first.transpose();
  m.view.row(1) = unseen.cross(first).transpose();
  return m;
}

}  // namespace

PoseFilter::PoseFilter(const WheelGeometry& wheels, const OdometryNoise& noise) : wheels_(wheels), noise_(noise) {
  std::string bad;
  const auto require = [&bad](bool good, const char* field, double value, const char* rule) {
    if (!good || !std::isfinite(value)) bad += fmt::format(" {} is {}, must be {};", field, value, rule);
  };
  require(wheels.radius_m > 0, "radius_m", wheels.radius_m, "> 0 m");
  require(wheels.separation_m > 0, "separation_m", wheels.separation_m, "> 0 m");
  require(noise.slip >= 0, "slip", noise.slip, ">= 0");
  require(noise.correlation_s > 0, "correlation_s", noise.correlation_s, "> 0 s");
  require(noise.angle_rad > 0, "angle_rad", noise.angle_rad, "> 0 rad");
  if (!bad.empty()) throw std::invalid_argument("PoseFilter:" + bad);
}

void PoseFilter::predict(double t_s, double left_rad, double right_rad) {
  const bool is_late = last_ && t_s < last_->t_s;
  if (!std::isfinite(t_s) || !std::isfinite(left_rad) || !std::isfinite(right_rad) || is_late) {
    throw std::invalid_argument(fmt::format(
        "PoseFilter::predict: t {} s, left {} rad, right {} rad: must be finite, and t not before the last one{}", t_s,
        left_rad, right_rad, last_ ? fmt::format(" ({} s)", last_->t_s) : ""));
  }
  if (last_) {
    const double dt_s = t_s - last_->t_s;
    const double left = left_rad - last_->left_rad;
    const double right = right_rad - last_->right_rad;
    if (believed_) believed_->predict(dt_s, left, right, wheels_, noise_);
    if (elsewhere_) elsewhere_->predict(dt_s, left, right, wheels_, noise_);
  }
  last_ = {t_s, left_rad, right_rad};
}

void PoseFilter::correct(const Fix& fix) {
  switch (fix.verdict) {
    case FixVerdict::kOk:
      if (const auto m = measurement_of(fix.position_m, fix.heading_rad, fix.covariance)) {
        if (m->rows == 3) {
          correct_by_pose(*m);
        } else {
          correct_by_part(*m);
        }
      }
      return;
    case FixVerdict::kAmbiguous: {
      const auto one = measurement_of(fix.position_m, fix.heading_rad, fix.covariance);
      const auto other = measurement_of(fix.other_position_m, fix.other_heading_rad, fix.other_covariance);
      if (!one || !other) return;
      for (auto* hypothesis : {&believed_, &elsewhere_}) {
        if (!*hypothesis || (*hypothesis)->expects(*one) == (*hypothesis)->expects(*other)) continue;
        (*hypothesis)->correct((*hypothesis)->expects(*one) ? *one : *other);
      }
      return;
    }
    case FixVerdict::kWeak:
      if (const auto m = measurement_across(fix)) correct_by_part(*m);
      return;
    case FixVerdict::kGap:
    case FixVerdict::kTooFew:
    case FixVerdict::kContradictory:
      return;
  }
}

void PoseFilter::correct_by_part(const Measurement& m) {
  for (auto* hypothesis : {&believed_, &elsewhere_}) {
    if (*hypothesis && (*hypothesis)->expects(m)) (*hypothesis)->correct(m);
  }
}

void PoseFilter::correct_by_pose(const Measurement& m) {
  const PoseEstimate told{{m.pose.x(), m.pose.y(), wrap_angle_rad(m.pose.z())}, m.covariance};
  if (!believed_) {
    believed_.emplace(told, noise_);
    state_ = FilterState::kTracking;
    return;
  }
  if (believed_->expects(m)) {
    believed_->correct(m);
    elsewhere_.reset();
    state_ = FilterState::kTracking;
    return;
  }
  state_ = FilterState::kLost;
  if (elsewhere_ && elsewhere_->expects(m)) {
    elsewhere_->correct(m);
    ++elsewhere_fixes_;
  } else {
    elsewhere_.emplace(told, noise_);
    elsewhere_fixes_ = 1;
  }
  if (elsewhere_fixes_ < kRelocateAfter) return;
  believed_ = elsewhere_;
  elsewhere_.reset();
  state_ = FilterState::kTracking;
}

std::optional<PoseEstimate> PoseFilter::estimate() const {
  if (!believed_) return std::nullopt;
  return believed_->estimate();
}

}  // namespace twocone::localisation

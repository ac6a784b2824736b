// SPDX-License-Identifier: Apache-2.0
#include "localisation/pose_filter.h"

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "base/errors.h"
#include "localisation/chi_squared.h"
#include "localisation/covariance.h"
#include "localisation/least_squares/posterior.h"
#include "localisation/wheel_step.h"

namespace twocone::localisation {
namespace {

/// A consistent fix with at least this many more numbers than unknowns is checked by itself. Two landmarks never have
/// so many.
constexpr int kCheckedBy = 2;

/// Returns the fix as a measurement; nothing where it has no valid covariance.
std::optional<PoseHypothesis::Measurement> measurement_of(const std::optional<Eigen::Vector2d>& position_m,
                                                          const std::optional<double>& heading_rad,
                                                          const std::optional<Eigen::Matrix3d>& covariance,
                                                          const std::optional<Eigen::Matrix3d>& own_covariance,
                                                          const BySharedErrors<3>& by_shared) {
  if (!position_m || !covariance || !position_m->allFinite() || (heading_rad && !std::isfinite(*heading_rad))) {
    return std::nullopt;
  }
  const bool is_good =
      heading_rad ? is_covariance<3>(*covariance) : is_covariance<2>(covariance->topLeftCorner<2, 2>());
  if (!is_good) return std::nullopt;
  return PoseHypothesis::Measurement{{position_m->x(), position_m->y(), heading_rad.value_or(0)},
                                     *covariance,
                                     heading_rad.has_value(),
                                     own_covariance.value_or(*covariance),
                                     by_shared};
}

/// Returns the weight w of `other` in (1 - w) own + w other, two informations, at which the determinant is greatest.
double weight_of_intersection(const Eigen::Matrix3d& own, const Eigen::Matrix3d& other) {
  // The logarithm of the determinant is concave, so that its slope falls.
  const auto slope = [&](double w) { return ((1 - w) * own + w * other).ldlt().solve(other - own).trace(); };
  constexpr double kMost = 1 - 1e-6;
  if (!(slope(0) > 0)) return 0;
  if (slope(kMost) > 0) return kMost;
  double low = 0;
  double high = kMost;
  for (int i = 0; i < 50; ++i) {
    const double middle = (low + high) / 2;
    (slope(middle) > 0 ? low : high) = middle;
  }
  return low;
}

}  // namespace

std::string_view to_string(FilterState state) { return state == FilterState::kLost ? "lost" : "tracking"; }

std::string_view to_string(FixUse use) {
  constexpr std::array<std::string_view, 10> kNames{"started",      "taken",         "relocated",  "no_fix",
                                                    "no_sigma",     "out_of_bounds", "unexpected", "undecided",
                                                    "not_gaussian", "cannot_start"};
  return kNames.at(std::size_t(use));
}

PoseHypothesis::PoseHypothesis(const PoseEstimate& start, const OdometryNoise& noise,
                               const BySharedErrors<3>& by_shared) {
  state_.head<3>() << start.pose.x_m, start.pose.y_m, start.pose.heading_rad;
  if (!state_.allFinite() || !is_covariance<3>(start.covariance)) {
    throw base::InvalidArgument(
        "PoseHypothesis: x {} m, y {} m, heading {} rad with the variances {} m2, {} m2, {} rad2: must be "
        "finite, with a symmetric and positive definite covariance",
        start.pose.x_m, start.pose.y_m, start.pose.heading_rad, start.covariance(0, 0), start.covariance(1, 1),
        start.covariance(2, 2));
  }
  covariance_ = start_covariance(noise);
  covariance_.topLeftCorner<3, 3>() = start.covariance / 2 + start.covariance.transpose() / 2;
  count_shared_errors(by_shared.cols());
  if (by_shared.cols() > 0) by_shared_.topRows<3>() = by_shared;
}

void PoseHypothesis::predict(double dt_s, double left_rad, double right_rad, const WheelGeometry& wheels,
                             const OdometryNoise& noise, const BySharedErrors<3>& wheels_by_shared) {
  const WheelStep step = wheel_step(state_, covariance_, dt_s, left_rad, right_rad, wheels, noise);
  Matrix p = step.covariance(covariance_, noise);
  Cross by_shared = step.by_state * by_shared_;
  if (wheels_by_shared.cols() > 0) {
    count_shared_errors(wheels_by_shared.cols());
    if (by_shared.cols() == 0) by_shared = by_shared_;
    // The true wheels travel farther than the believed ones by their errors, so the estimate falls behind.
    Cross added = Cross::Zero(8, by_shared.cols());
    added.topRows<3>() = -step.by_wheels * wheels_by_shared;
    const Matrix common = by_shared * added.transpose();
    p += common + common.transpose() + added * added.transpose();
    by_shared += added;
  }
  if (!step.state.allFinite() || !p.allFinite() || !(p.diagonal().minCoeff() >= 0)) {
    throw base::InvalidArgument(
        "PoseHypothesis::predict: {} rad of the left and {} rad of the right wheel in {} s exceed the "
        "range of numbers",
        left_rad, right_rad, dt_s);
  }
  covariance_ = p / 2 + p.transpose() / 2;  // halved first: a sum may overflow
  by_shared_ = by_shared;
  state_ = step.state;
}

void PoseHypothesis::count_shared_errors(Eigen::Index count) {
  if (count == 0 || count == by_shared_.cols()) return;
  if (by_shared_.cols() > 0) {
    throw base::InvalidArgument("PoseHypothesis: {} shared errors, must be the {} of before", count, by_shared_.cols());
  }
  by_shared_ = Cross::Zero(8, count);
}

PoseHypothesis::Linear PoseHypothesis::linear(const Measurement& m) const {
  Linear l;
  const int n = m.rows();
  l.slopes.topLeftCorner(n, n).setIdentity();
  Eigen::Vector3d apart = m.pose - state_.head<3>();
  apart.z() = wrap_angle_rad(apart.z());
  l.difference.head(n) = apart.head(n);
  l.by_shared = BySharedErrors<3>::Zero(3, by_shared_.cols());
  const bool is_split = m.by_shared.cols() == by_shared_.cols();
  if (is_split) l.by_shared.topRows(n) = m.by_shared.topRows(n);
  l.own_covariance.topLeftCorner(n, n) = (is_split ? m.own_covariance : m.covariance).topLeftCorner(n, n);
  return l;
}

Eigen::Matrix3d PoseHypothesis::spread(const Linear& l) const {
  const Eigen::Matrix3d common = l.slopes * by_shared_ * l.by_shared.transpose();
  return l.slopes * covariance_ * l.slopes.transpose() + l.own_covariance + l.by_shared * l.by_shared.transpose() -
         common - common.transpose();
}

bool PoseHypothesis::expects(const Measurement& m) const {
  const Linear l = linear(m);
  const Eigen::LLT<Eigen::Matrix3d> llt(spread(l));
  if (llt.info() != Eigen::Success) return false;
  return chi_squared_tail(l.difference.dot(llt.solve(l.difference)), m.rows()) >= PoseFilter::kGate;
}

bool PoseHypothesis::correct(const Measurement& m) {
  count_shared_errors(m.by_shared.cols());
  return update(linear(m));
}

bool PoseHypothesis::intersect(const Measurement& m) {
  const Eigen::Matrix3d own = covariance_.topLeftCorner<3, 3>().inverse();
  const double weight = weight_of_intersection(own, m.covariance.inverse());
  if (weight == 0) return true;  // the pose is better in all directions
  const Matrix before = covariance_;
  Linear l = linear({.pose = m.pose, .covariance = m.covariance / weight, .has_heading = true});
  covariance_.topLeftCorner<3, 3>() /= 1 - weight;
  if (update(l)) return true;
  covariance_ = before;
  return false;
}

bool PoseHypothesis::update(const Linear& l) {
  const Eigen::Matrix<double, 3, 8> correlation = l.slopes * covariance_ - l.by_shared * by_shared_.transpose();
  const Eigen::Matrix<double, 8, 3> gain = spread(l).llt().solve(correlation).transpose();
  const Matrix left = Matrix::Identity() - gain * l.slopes;
  const Cross by_own = left * by_shared_;
  const Cross by_measured = gain * l.by_shared;
  const Matrix common = by_own * by_measured.transpose();
  const Matrix p = left * covariance_ * left.transpose() + gain * l.own_covariance * gain.transpose() +
                   by_measured * by_measured.transpose() + common + common.transpose();
  const Vector state = state_ + gain * l.difference;
  const Matrix symmetric = p / 2 + p.transpose() / 2;
  if (!state.allFinite() || !symmetric.allFinite() || !(symmetric.diagonal().minCoeff() >= 0) ||
      !is_covariance<3>(symmetric.topLeftCorner<3, 3>())) {
    return false;
  }
  covariance_ = symmetric;
  by_shared_ = by_own + by_measured;
  state_ = state;
  state_[kHeading] = wrap_angle_rad(state_[kHeading]);
  return true;
}

FixUse PoseHypothesis::correct(const Fix& weak) {
  using least_squares::Posterior;
  const Eigen::Matrix3d prior = covariance_.topLeftCorner<3, 3>();
  const Posterior posterior = least_squares::update(state_.head<3>(), prior, weak.measurements, weak.widening);
  if (posterior.kind == Posterior::Kind::kNothing) return FixUse::kNoSigma;
  // A contradiction among the measurements themselves does not count as one with the prior.
  const double against_prior = posterior.chi_squared - weak.chi_squared / weak.widening;
  if (chi_squared_tail(against_prior, 3) < PoseFilter::kGate) return FixUse::kUnexpected;
  if (posterior.kind == Posterior::Kind::kNotGaussian) return FixUse::kNotGaussian;
  const least_squares::LinearMeasurement& m = posterior.measurement;
  count_shared_errors(m.by_shared.cols());
  Linear l;
  l.slopes.leftCols<3>() = m.slopes;
  l.difference = m.error;
  l.own_covariance = m.own_covariance;
  l.by_shared = BySharedErrors<3>::Zero(3, by_shared_.cols());
  if (m.by_shared.cols() > 0) l.by_shared = m.by_shared;
  return update(l) ? FixUse::kTaken : FixUse::kNoSigma;
}

PoseEstimate PoseHypothesis::estimate() const {
  return {{state_[kX], state_[kY], state_[kHeading]}, covariance_.topLeftCorner<3, 3>()};
}

PoseFilter::PoseFilter(const WheelGeometry& wheels, const OdometryNoise& noise, BySharedErrors<3> wheels_by_shared)
    : wheels_(wheels), noise_(noise), wheels_by_shared_(std::move(wheels_by_shared)) {
  base::Complaints bad;
  bad.require_field(base::is_positive(wheels.radius_m), "radius_m", wheels.radius_m, "> 0 m");
  bad.require_field(base::is_positive(wheels.separation_m), "separation_m", wheels.separation_m, "> 0 m");
  bad.require_field(noise.slip >= 0 && std::isfinite(noise.slip), "slip", noise.slip, ">= 0");
  bad.require_field(base::is_positive(noise.correlation_s), "correlation_s", noise.correlation_s, "> 0 s");
  bad.require_field(base::is_positive(noise.angle_rad), "angle_rad", noise.angle_rad, "> 0 rad");
  bad.raise("PoseFilter");
}

void PoseFilter::predict(double t_s, double left_rad, double right_rad) {
  const bool is_late = last_ && t_s < last_->t_s;
  if (!std::isfinite(t_s) || !std::isfinite(left_rad) || !std::isfinite(right_rad) || is_late) {
    throw base::InvalidArgument(
        "PoseFilter::predict: t {} s, left {} rad, right {} rad: must be finite, and t not before the last one{}", t_s,
        left_rad, right_rad, last_ ? fmt::format(" ({} s)", last_->t_s) : "");
  }
  if (last_) {
    const double dt_s = t_s - last_->t_s;
    const double left = left_rad - last_->left_rad;
    const double right = right_rad - last_->right_rad;
    if (!std::isfinite(dt_s) || !std::isfinite(left) || !std::isfinite(right)) {
      throw base::InvalidArgument(
          "PoseFilter::predict: from {} s, {} rad, {} rad to {} s, {} rad, {} rad exceeds the range of numbers",
          last_->t_s, last_->left_rad, last_->right_rad, t_s, left_rad, right_rad);
    }
    if (believed_) believed_->predict(dt_s, left, right, wheels_, noise_, wheels_by_shared_);
    try {
      if (elsewhere_) {
        elsewhere_->hypothesis.predict(dt_s, left, right, wheels_, noise_, wheels_by_shared_);
        elsewhere_->turn(left, right, wheels_, noise_);
      }
    } catch (const std::invalid_argument&) {
      elsewhere_.reset();  // it is too vague to continue from, which is no reason to refuse the reading
    }
  }
  last_ = {t_s, left_rad, right_rad};
}

FixUse PoseFilter::correct(const Fix& fix) {
  switch (fix.verdict) {
    case FixVerdict::kOk: {
      const auto m = measurement_of(fix.position_m, fix.heading_rad, fix.covariance, fix.own_covariance, fix.by_shared);
      if (!m) return FixUse::kNoSigma;
      return m->has_heading ? correct_by_pose(*m, fix.degrees_of_freedom >= kCheckedBy) : correct_by_position(*m);
    }
    case FixVerdict::kAmbiguous: {
      const auto one =
          measurement_of(fix.position_m, fix.heading_rad, fix.covariance, fix.own_covariance, fix.by_shared);
      const auto other = measurement_of(fix.other_position_m, fix.other_heading_rad, fix.other_covariance,
                                        fix.other_own_covariance, fix.other_by_shared);
      return one && other ? correct_by_one_of(*one, *other) : FixUse::kNoSigma;
    }
    case FixVerdict::kWeak:
      if (elsewhere_) elsewhere_->hypothesis.correct(fix);
      return believed_ ? believed_->correct(fix) : FixUse::kCannotStart;
    case FixVerdict::kOutOfBounds:
      return FixUse::kOutOfBounds;
    case FixVerdict::kGap:
    case FixVerdict::kTooFew:
    case FixVerdict::kContradictory:
      return FixUse::kNoFix;
  }
  assert(false);
  return FixUse::kNoFix;
}

void PoseFilter::Elsewhere::turn(double left_rad, double right_rad, const WheelGeometry& wheels,
                                 const OdometryNoise& noise) {
  const double per_wheel = wheels.radius_m / wheels.separation_m;
  turned_rad += (right_rad - left_rad) * per_wheel;
  // Both wheels' errors are summed as in the worst case, step by step. Independent errors cause less.
  vague_rad += (noise.slip * (std::abs(left_rad) + std::abs(right_rad)) + noise.angle_rad) * per_wheel;
}

bool PoseFilter::Elsewhere::shows_turn(const Measurement& m) const {
  const double mirrored_rad = wrap_angle_rad(m.pose.z() - first.pose.z() + turned_rad);
  const double variance = first.covariance(2, 2) + m.covariance(2, 2) + vague_rad * vague_rad;
  return chi_squared_tail(mirrored_rad * mirrored_rad / variance, 1) < kGate;
}

FixUse PoseFilter::correct_by_one_of(const Measurement& one, const Measurement& other) {
  const auto correct_one = [&](PoseHypothesis& hypothesis) {
    const bool expects_one = hypothesis.expects(one);
    const bool expects_other = hypothesis.expects(other);
    if (expects_one && expects_other) return FixUse::kUndecided;
    if (!expects_one && !expects_other) return FixUse::kUnexpected;
    return hypothesis.correct(expects_one ? one : other) ? FixUse::kTaken : FixUse::kNoSigma;
  };
  if (elsewhere_) static_cast<void>(correct_one(elsewhere_->hypothesis));
  return believed_ ? correct_one(*believed_) : FixUse::kCannotStart;
}

FixUse PoseFilter::correct_by_position(const Measurement& m) {
  if (elsewhere_ && elsewhere_->hypothesis.expects(m)) static_cast<void>(elsewhere_->hypothesis.correct(m));
  if (!believed_) return FixUse::kCannotStart;
  if (!believed_->expects(m)) return FixUse::kUnexpected;
  return believed_->correct(m) ? FixUse::kTaken : FixUse::kNoSigma;
}

FixUse PoseFilter::correct_by_pose(const Measurement& m, bool is_checked) {
  const PoseEstimate measured{{m.pose.x(), m.pose.y(), wrap_angle_rad(m.pose.z())}, m.covariance};
  if (!believed_) {
    believed_.emplace(measured, noise_, m.by_shared);
    state_ = FilterState::kTracking;
    return FixUse::kStarted;
  }
  if (believed_->expects(m)) {
    if (!believed_->correct(m)) return FixUse::kNoSigma;
    elsewhere_.reset();
    state_ = FilterState::kTracking;
    return FixUse::kTaken;
  }
  state_ = FilterState::kLost;
  if (elsewhere_ && elsewhere_->hypothesis.expects(m) && elsewhere_->hypothesis.correct(m)) {
    ++elsewhere_->fixes;
    elsewhere_->has_turned = elsewhere_->has_turned || elsewhere_->shows_turn(m);
  } else {
    elsewhere_.emplace(Elsewhere{.hypothesis = PoseHypothesis(measured, noise_, m.by_shared), .first = m});
  }
  elsewhere_->checked += is_checked ? 1 : 0;
  const bool is_found =
      elsewhere_->checked >= kRelocateAfter || (elsewhere_->fixes >= kRelocateAfter && elsewhere_->has_turned);
  if (!is_found) return FixUse::kUnexpected;
  believed_ = elsewhere_->hypothesis;
  elsewhere_.reset();
  state_ = FilterState::kTracking;
  return FixUse::kRelocated;
}

FixUse PoseFilter::correct_by_second_source(const Pose& pose, const Eigen::Matrix3d& covariance) {
  const auto m = measurement_of(Eigen::Vector2d(pose.x_m, pose.y_m), pose.heading_rad, covariance, covariance, {});
  if (!m) return FixUse::kNoSigma;
  if (!believed_) return correct_by_pose(*m, false);
  if (state_ == FilterState::kLost) return FixUse::kUndecided;
  if (!believed_->expects(*m)) return FixUse::kUnexpected;
  return believed_->intersect(*m) ? FixUse::kTaken : FixUse::kNoSigma;
}

std::optional<PoseEstimate> PoseFilter::estimate() const {
  if (!believed_) return std::nullopt;
  return believed_->estimate();
}

}  // namespace twocone::localisation

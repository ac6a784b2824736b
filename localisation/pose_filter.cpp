// SPDX-License-Identifier: Apache-2.0
#include "localisation/pose_filter.h"

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include "localisation/chi_squared.h"
#include "localisation/covariance.h"

namespace twocone::localisation {
namespace {

/// A consistent fix with at least this many more numbers than unknowns is checked by itself; two landmarks never have
/// them.
constexpr int kCheckedBy = 2;

/// Returns nothing where the fix has no valid covariance.
std::optional<PoseHypothesis::Measurement> measurement_of(const std::optional<Eigen::Vector2d>& position_m,
                                                          const std::optional<double>& heading_rad,
                                                          const std::optional<Eigen::Matrix3d>& covariance) {
  if (!position_m || !covariance || !position_m->allFinite() || (heading_rad && !std::isfinite(*heading_rad))) {
    return std::nullopt;
  }
  const bool is_good =
      heading_rad ? is_covariance<3>(*covariance) : is_covariance<2>(covariance->topLeftCorner<2, 2>());
  if (!is_good) return std::nullopt;
  return PoseHypothesis::Measurement{
      {position_m->x(), position_m->y(), heading_rad.value_or(0)}, *covariance, heading_rad.has_value()};
}

}  // namespace

std::string_view to_string(FilterState state) { return state == FilterState::kLost ? "lost" : "tracking"; }

std::string_view to_string(FixUse use) {
  constexpr std::array<std::string_view, 10> kNames{"started",      "taken",         "relocated",  "no_fix",
                                                    "no_sigma",     "out_of_bounds", "unexpected", "undecided",
                                                    "not_gaussian", "cannot_start"};
  return kNames.at(std::size_t(use));
}

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
    if (!std::isfinite(dt_s) || !std::isfinite(left) || !std::isfinite(right)) {
      throw std::invalid_argument(fmt::format(
          "PoseFilter::predict: from {} s, {} rad, {} rad to {} s, {} rad, {} rad exceeds the range of numbers",
          last_->t_s, last_->left_rad, last_->right_rad, t_s, left_rad, right_rad));
    }
    if (believed_) believed_->predict(dt_s, left, right, wheels_, noise_);
    try {
      if (elsewhere_) {
        elsewhere_->hypothesis.predict(dt_s, left, right, wheels_, noise_);
        elsewhere_->turn(left, right, wheels_, noise_);
      }
    } catch (const std::invalid_argument&) {
      elsewhere_.reset();  // too vague to continue from; that is no reason to refuse the reading
    }
  }
  last_ = {t_s, left_rad, right_rad};
}

FixUse PoseFilter::correct(const Fix& fix) {
  switch (fix.verdict) {
    case FixVerdict::kOk: {
      const auto m = measurement_of(fix.position_m, fix.heading_rad, fix.covariance);
      if (!m) return FixUse::kNoSigma;
      return m->has_heading ? correct_by_pose(*m, fix.degrees_of_freedom >= kCheckedBy) : correct_by_position(*m);
    }
    case FixVerdict::kAmbiguous: {
      const auto one = measurement_of(fix.position_m, fix.heading_rad, fix.covariance);
      const auto other = measurement_of(fix.other_position_m, fix.other_heading_rad, fix.other_covariance);
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
  // Both wheels' errors are summed as in the worst case, step by step: more than independent errors cause.
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
    believed_.emplace(measured, noise_);
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
    elsewhere_.emplace(Elsewhere{.hypothesis = PoseHypothesis(measured, noise_), .first = m});
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

std::optional<PoseEstimate> PoseFilter::estimate() const {
  if (!believed_) return std::nullopt;
  return believed_->estimate();
}

}  // namespace twocone::localisation

// SPDX-License-Identifier: Apache-2.0
#include "localisation/map_filter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "base/errors.h"
#include "localisation/chi_squared.h"
#include "localisation/wheel_step.h"
#include "vision/ranging.h"

namespace twocone::localisation {
namespace {

using vision::Side;

// Relative standard deviation of a radius that follows from an area: shadows and a mast take a part of it.
constexpr double kAreaRadiusShare = 0.2;
// A part of a thing may be hidden, so that its area says too little.
constexpr double kHiddenRadius_m = 0.02;

/// The pixel of a landmark's near point, with its derivatives.
struct ShownPoint {
  Eigen::Vector2d pixel_px;
  Eigen::Matrix2d by_place;  ///< by the axis's place in the body frame
  Eigen::Vector2d by_top, by_radius;
};

/// @param place_m in the body frame @param numbers of the landmark
std::optional<ShownPoint> show(const vision::MirrorView& view, const Eigen::Vector2d& place_m,
                               const Eigen::Vector4d& numbers) {
  const auto near_m = near_top_point(view, place_m, numbers[vision::kRadius], numbers[vision::kTop]);
  if (!near_m) return std::nullopt;
  const auto shown = view.project_with_jacobian(*near_m, vision::Rim::kGoesOn);
  if (!shown) return std::nullopt;
  const Eigen::Vector2d from_axis = place_m - view.settings().axis_offset_m;
  const double distance_m = from_axis.norm();
  const Eigen::Vector2d out = from_axis / distance_m;
  const Eigen::Matrix2d across = Eigen::Matrix2d::Identity() - out * out.transpose();
  const Eigen::Matrix2d near_by_place = Eigen::Matrix2d::Identity() - numbers[vision::kRadius] / distance_m * across;
  const Eigen::Matrix2d by_floor = shown->jacobian.leftCols<2>();
  return ShownPoint{shown->pixel_px, by_floor * near_by_place, shown->jacobian.col(2), -by_floor * out};
}

}  // namespace

MapFilter::MapFilter(const vision::Rig& rig, const vision::BeliefErrors& errors, const WheelGeometry& wheels,
                     const OdometryNoise& noise, const BySharedErrors<3>& wheels_by_shared, const Pose& start)
    : rig_(rig, errors.rig),
      sighting_px_(errors.sighting_px),
      wheels_(wheels),
      noise_(noise),
      wheels_by_shared_(wheels_by_shared),
      state_(Eigen::VectorXd::Zero(kPoseSize)),
      own_(start_covariance(noise)),
      by_shared_(Eigen::MatrixXd::Zero(kPoseSize, std::max(errors.rig.cols(), wheels_by_shared.cols()))) {
  state_.head<3>() << start.x_m, start.y_m, start.heading_rad;
}

void MapFilter::predict(double t_s, double left_rad, double right_rad) {
  const bool is_late = last_ && t_s < last_->t_s;
  if (!std::isfinite(t_s) || !std::isfinite(left_rad) || !std::isfinite(right_rad) || is_late) {
    throw base::InvalidArgument(
        "MapFilter::predict: t {} s, left {} rad, right {} rad: must be finite, and t not before the last one", t_s,
        left_rad, right_rad);
  }
  if (last_) {
    const PoseHypothesis::Matrix before = own_.topLeftCorner<kPoseSize, kPoseSize>();
    const WheelStep step = wheel_step(state_.head<kPoseSize>(), before, t_s - last_->t_s, left_rad - last_->left_rad,
                                      right_rad - last_->right_rad, wheels_, noise_);
    state_.head<kPoseSize>() = step.state;
    const Eigen::Index others = state_.size() - kPoseSize;
    own_.topLeftCorner<kPoseSize, kPoseSize>() = step.covariance(before, noise_);
    own_.topRightCorner(kPoseSize, others) = (step.by_state * own_.topRightCorner(kPoseSize, others)).eval();
    own_.bottomLeftCorner(others, kPoseSize) = own_.topRightCorner(kPoseSize, others).transpose();
    by_shared_.topRows<kPoseSize>() = (step.by_state * by_shared_.topRows<kPoseSize>()).eval();
    if (wheels_by_shared_.cols() > 0) by_shared_.topRows<3>() -= step.by_wheels * wheels_by_shared_;
  }
  last_ = {t_s, left_rad, right_rad};
}

std::optional<MapFilter::Linear> MapFilter::linear(const vision::RoughLandmark& thing,
                                                   const Eigen::Vector4d& numbers) const {
  const Pose pose = estimated();
  const Eigen::Matrix2d to_body = Eigen::Rotation2Dd(-pose.heading_rad).toRotationMatrix();
  const Eigen::Vector2d place_m = in_body(pose, numbers.head<2>());
  // A turn of the body by a small angle turns what it sees the other way.
  const Eigen::Vector2d by_heading(place_m.y(), -place_m.x());
  const Eigen::Index rows = 2 * std::ranges::count(thing.is_shown, true);
  if (rows == 0) return std::nullopt;
  Linear l{.by_pose = UpTo4Rows<3>(rows, 3),
           .by_landmark = UpTo4Rows<4>(rows, 4),
           .difference = UpTo4Rows<1>(rows),
           .noise = UpTo4By4::Zero(rows, rows),
           .by_shared = Eigen::MatrixXd::Zero(rows, by_shared_.cols())};
  Eigen::Index row = 0;
  for (const Side side : {Side::kLower, Side::kUpper}) {
    if (!thing.is_shown[std::size_t(side)]) continue;
    const auto shown = show(of_view(rig_.rig(), side), place_m, numbers);
    if (!shown) return std::nullopt;
    const vision::Sighting& seen = thing.views[std::size_t(side)];
    l.by_pose.block<2, 2>(row, 0) = -shown->by_place * to_body;
    l.by_pose.block<2, 1>(row, 2) = shown->by_place * by_heading;
    l.by_landmark.block<2, 2>(row, vision::kPlaceX) = shown->by_place * to_body;
    l.by_landmark.block<2, 1>(row, vision::kTop) = shown->by_top;
    l.by_landmark.block<2, 1>(row, vision::kRadius) = shown->by_radius * numbers[vision::kRadius];
    l.difference.segment<2>(row) = seen.pixel_px - shown->pixel_px;
    l.noise.block<2, 2>(row, row) = seen.covariance_px2 + sighting_px_ * sighting_px_ * Eigen::Matrix2d::Identity();
    if (!rig_.is_exact()) {
      l.by_shared.middleRows(row, 2) =
          rig_.pixel_by_shared(side, place_m, numbers[vision::kRadius], numbers[vision::kTop]);
    }
    row += 2;
  }
  return l.difference.allFinite() && l.by_pose.allFinite() ? std::optional(std::move(l)) : std::nullopt;
}

Eigen::MatrixXd MapFilter::remaining_by_shared(const Linear& l, std::size_t landmark) const {
  return l.by_shared - l.by_pose * by_shared_.topRows<3>() - l.by_landmark * by_shared_.middleRows<4>(at(landmark));
}

MapFilter::UpTo4By4 MapFilter::spread(const Linear& l, std::size_t landmark) const {
  const Eigen::Index i = at(landmark);
  UpTo4Rows<7> slopes(l.difference.rows(), 7);
  slopes << l.by_pose, l.by_landmark;
  Eigen::Matrix<double, 7, 7> own;
  own << own_.topLeftCorner<3, 3>(), own_.block<3, 4>(0, i), own_.block<4, 3>(i, 0), own_.block<4, 4>(i, i);
  const Eigen::MatrixXd shared = remaining_by_shared(l, landmark);
  return slopes * own * slopes.transpose() + shared * shared.transpose() + l.noise;
}

double MapFilter::likeness(const vision::RoughLandmark& thing, std::size_t landmark) const {
  const auto l = linear(thing, numbers(landmark));
  if (!l) return 0;
  const Eigen::LLT<UpTo4By4> llt(spread(*l, landmark));
  if (llt.info() != Eigen::Success) return 0;
  return chi_squared_tail(l->difference.dot(llt.solve(l->difference)), int(l->difference.rows()));
}

bool MapFilter::update(const vision::RoughLandmark& thing, std::size_t landmark) {
  const Eigen::Index i = at(landmark);
  const auto l = linear(thing, numbers(landmark));
  if (!l) return false;
  const Eigen::LLT<UpTo4By4> llt(spread(*l, landmark));
  if (llt.info() != Eigen::Success) return false;
  const Eigen::MatrixXd own_slopes =
      own_.leftCols<3>() * l->by_pose.transpose() + own_.middleCols<4>(i) * l->by_landmark.transpose();  // P H^T
  const Eigen::MatrixXd shared = remaining_by_shared(*l, landmark);
  const Eigen::MatrixXd gain = llt.solve((own_slopes - by_shared_ * shared.transpose()).transpose()).transpose();
  // The own part of Joseph's form, expanded, so that only products of four columns remain.
  const UpTo4By4 own_spread =
      l->by_pose * own_slopes.topRows<3>() + l->by_landmark * own_slopes.middleRows<4>(i) + l->noise;
  const Eigen::MatrixXd mixed = own_slopes * gain.transpose();
  Eigen::MatrixXd own = own_ - mixed - mixed.transpose() + gain * own_spread * gain.transpose();
  const Eigen::VectorXd state = state_ + gain * l->difference;
  if (!state.allFinite() || !own.allFinite() || !(own.diagonal().minCoeff() >= 0)) return false;
  own_ = (own + own.transpose()) / 2;
  by_shared_ += gain * shared;
  state_ = state;
  state_[kHeading] = wrap_angle_rad(state_[kHeading]);
  known_[landmark].sightings += 1;
  known_[landmark].last_frame = frames_;
  return true;
}

void MapFilter::update_radius(std::size_t landmark, double radius_m, double sigma_m) {
  const Eigen::Index i = at(landmark) + vision::kRadius;
  const Eigen::RowVectorXd by_shared = by_shared_.row(i);
  const Eigen::VectorXd column = own_.col(i);
  const double sigma = sigma_m / radius_m;  // of the logarithm
  const double own_spread = column[i] + sigma * sigma;
  const Eigen::VectorXd gain = (column + by_shared_ * by_shared.transpose()) / (own_spread + by_shared.squaredNorm());
  const Eigen::VectorXd state = state_ + gain * (std::log(radius_m) - state_[i]);
  if (!state.allFinite()) return;
  const Eigen::MatrixXd mixed = column * gain.transpose();
  own_ += own_spread * gain * gain.transpose() - mixed - mixed.transpose();
  by_shared_ -= gain * by_shared;
  state_ = state;
  state_[kHeading] = wrap_angle_rad(state_[kHeading]);
}

bool MapFilter::is_apart(const vision::RoughLandmark& thing) const {
  const Pose pose = estimated();
  const Eigen::Vector2d place_m =
      Eigen::Vector2d(pose.x_m, pose.y_m) +
      Eigen::Rotation2Dd(pose.heading_rad + thing.bearing_rad) * Eigen::Vector2d(thing.range_m, 0);
  for (std::size_t k = 0; k < known_.size(); ++k) {
    if (known_[k].hue != thing.hue) continue;
    const auto l = linear(thing, numbers(k));
    if (!l) continue;
    // The covariance of the difference of both places, seen from the body: through the pixels, at the landmark.
    const Eigen::Matrix<double, 4, 3> by_top_too = l->by_landmark.leftCols<3>();
    const Eigen::Matrix4d pixels = spread(*l, k);
    const Eigen::Matrix3d of_numbers = (by_top_too.transpose() * pixels.inverse() * by_top_too).inverse();
    const Eigen::Vector2d apart_m = place_m - state_.segment<2>(at(k));
    const double sigmas2 = apart_m.dot(of_numbers.topLeftCorner<2, 2>().inverse() * apart_m);
    if (apart_m.norm() < kApart_m || !(sigmas2 > kApartSigmas * kApartSigmas)) return false;
  }
  return true;
}

std::optional<std::size_t> MapFilter::add(const vision::RoughLandmark& thing) {
  const Pose pose = estimated();
  const Eigen::Vector2d arm_m =
      Eigen::Rotation2Dd(pose.heading_rad + thing.bearing_rad) * Eigen::Vector2d(thing.range_m, 0);
  Eigen::Vector4d numbers;
  numbers << pose.x_m + arm_m.x(), pose.y_m + arm_m.y(), thing.top_m, thing.radius_m;
  const auto l = linear(thing, numbers);
  if (!l) return std::nullopt;
  // The four pixels determine place and top, for a given radius: d = A (n + D e - slopes of pose and radius).
  const Eigen::Matrix<double, 4, 3> by_free = l->by_landmark.leftCols<3>();
  const Eigen::Matrix4d weight = (l->noise + l->by_shared * l->by_shared.transpose()).inverse();
  const Eigen::Matrix3d normal = by_free.transpose() * weight * by_free;
  const Eigen::Matrix<double, 3, 4> solve = normal.ldlt().solve(by_free.transpose() * weight);
  if (!solve.allFinite()) return std::nullopt;
  numbers.head<3>() += solve * l->difference;
  // Rows: place, top, logarithm of the radius. Columns: the errors of the pose's estimate, of the pixels, of the
  // radius' estimate.
  Eigen::Matrix<double, 4, 3> by_pose = Eigen::Matrix<double, 4, 3>::Zero();
  by_pose.topRows<3>() = -solve * l->by_pose;
  Eigen::Matrix4d by_noise = Eigen::Matrix4d::Zero();
  by_noise.topRows<3>() = solve;
  Eigen::Vector4d by_radius;
  by_radius << -solve * l->by_landmark.col(vision::kRadius), 1;
  const double radius_sigma_m =
      thing.radius_sigma_m > 0 ? thing.radius_sigma_m : std::hypot(kAreaRadiusShare * thing.radius_m, kHiddenRadius_m);
  const double radius_sigma = radius_sigma_m / thing.radius_m;
  numbers[vision::kRadius] = std::log(thing.radius_m);

  const Eigen::Index old = state_.size();
  const Eigen::MatrixXd cross = by_pose * own_.topRows<3>();
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(old + 4, old + 4);
  own.topLeftCorner(old, old) = own_;
  own.bottomLeftCorner(4, old) = cross;
  own.topRightCorner(old, 4) = cross.transpose();
  own.bottomRightCorner<4, 4>() = by_pose * own_.topLeftCorner<3, 3>() * by_pose.transpose() +
                                  by_noise * l->noise * by_noise.transpose() +
                                  radius_sigma * radius_sigma * by_radius * by_radius.transpose();
  Eigen::MatrixXd by_shared(old + 4, by_shared_.cols());
  by_shared << by_shared_, by_pose * by_shared_.topRows<3>() + by_noise * l->by_shared;
  Eigen::VectorXd state(old + 4);
  state << state_, numbers;
  if (!state.allFinite() || !own.allFinite()) return std::nullopt;
  state_ = state;
  own_ = (own + own.transpose()) / 2;
  by_shared_ = by_shared;
  known_.push_back({thing.hue, 1, frames_, frames_});
  return known_.size() - 1;
}

std::vector<std::optional<std::size_t>> MapFilter::observe(std::span<const vision::RoughLandmark> things) {
  ++frames_;
  std::vector<std::optional<std::size_t>> landmarks(things.size());
  std::vector<bool> is_done(things.size(), false);
  const std::size_t before = known_.size();
  std::vector<bool> is_taken(before, false);
  // The pair that agrees best first: its update makes the others more certain.
  for (;;) {
    double most = kGate;
    std::optional<std::pair<std::size_t, std::size_t>> best;
    for (std::size_t i = 0; i < things.size(); ++i) {
      for (std::size_t k = 0; k < before; ++k) {
        if (is_done[i] || is_taken[k] || known_[k].hue != things[i].hue) continue;
        const double alike = likeness(things[i], k);
        if (alike >= most) {
          most = alike;
          best = {i, k};
        }
      }
    }
    if (!best) break;
    is_done[best->first] = is_taken[best->second] = true;
    const vision::RoughLandmark& thing = things[best->first];
    if (!update(thing, best->second)) continue;
    landmarks[best->first] = best->second;
    if (thing.radius_sigma_m > 0) update_radius(best->second, thing.radius_m, thing.radius_sigma_m);
  }
  for (std::size_t i = 0; i < things.size(); ++i) {
    const bool is_in_both = things[i].is_shown[0] && things[i].is_shown[1];
    if (!is_done[i] && is_in_both && is_apart(things[i])) landmarks[i] = add(things[i]);
  }
  return landmarks;
}

void MapFilter::remove(std::size_t landmark) {
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < state_.size(); ++i) {
    if (i < at(landmark) || i >= at(landmark) + 4) kept.push_back(i);
  }
  state_ = state_(kept).eval();
  own_ = own_(kept, kept).eval();
  by_shared_ = by_shared_(kept, Eigen::indexing::all).eval();
  known_.erase(known_.begin() + std::ptrdiff_t(landmark));
}

PoseEstimate MapFilter::pose() const {
  const Eigen::Matrix3d shared = by_shared_.topRows<3>() * by_shared_.topRows<3>().transpose();
  return {estimated(), own_.topLeftCorner<3, 3>() + shared};
}

Eigen::Vector4d MapFilter::numbers(std::size_t landmark) const {
  Eigen::Vector4d numbers = state_.segment<4>(at(landmark));
  numbers[vision::kRadius] = std::exp(numbers[vision::kRadius]);
  return numbers;
}

FoundLandmark MapFilter::landmark(std::size_t index) const {
  const Known& known = known_.at(index);
  const Eigen::Index i = at(index);
  const Eigen::Vector4d found = numbers(index);
  const Eigen::Vector4d of_numbers(1, 1, 1, found[vision::kRadius]);  // their slopes by the state
  const Eigen::Matrix4d shared = by_shared_.middleRows<4>(i) * by_shared_.middleRows<4>(i).transpose();
  return {known.hue,
          found,
          of_numbers.asDiagonal() * (own_.block<4, 4>(i, i) + shared) * of_numbers.asDiagonal(),
          known.sightings,
          known.first_frame,
          known.last_frame};
}

bool MapFilter::is_in_view(std::size_t index) const {
  const Eigen::Vector4d found = numbers(index);
  const Eigen::Vector2d place_m = in_body(estimated(), found.head<2>());
  return std::ranges::any_of(std::array{Side::kLower, Side::kUpper}, [&](Side side) {
    const vision::MirrorView& view = of_view(rig_.rig(), side);
    const auto near_m = near_top_point(view, place_m, found[vision::kRadius], found[vision::kTop]);
    return near_m && view.project(*near_m).has_value();
  });
}

}  // namespace twocone::localisation

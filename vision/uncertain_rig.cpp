// SPDX-License-Identifier: Apache-2.0
#include "vision/uncertain_rig.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include <Eigen/LU>

#include "vision/ranging.h"

namespace twocone::vision {
namespace {

// Steps of the central differences. Their relative error, (step / size)^2, is below 1e-8; rounding of a pixel of some
// hundreds adds 1e-13 / step of it.
constexpr double kLengthStep_m = 1e-5;
constexpr double kAngleStep_rad = 1e-5;
constexpr double kPixelStep_px = 1e-2;
constexpr double kLensStep = 1e-4;

constexpr std::array<const char*, kViewNumbers> kViewNames{
    "centre_px.column", "centre_px.row",   "rim_radius_px",   "azimuth_rad", "tilt_rad.x",
    "tilt_rad.y",       "axis_offset_m.x", "axis_offset_m.y", "apex_rad",    "mirror_radius_m",
    "lens_to_tip_m",    "distortion.k1",   "distortion.k2"};

double step_of(int number) {
  if (number >= kLensHeight) return kLengthStep_m;
  switch (ViewNumber(number % kViewNumbers)) {
    case kColumn:
    case kRow:
    case kRim:
      return kPixelStep_px;
    case kAzimuth:
    case kTiltX:
    case kTiltY:
    case kApex:
      return kAngleStep_rad;
    case kK1:
    case kK2:
      return kLensStep;
    case kOffsetX:
    case kOffsetY:
    case kMirrorRadius:
    case kLensToTip:
    case kViewNumbers:
      break;
  }
  return kLengthStep_m;
}

MirrorView with_errors(const MirrorView& view, Side side, const Eigen::VectorXd& errors, double lens_height_error_m) {
  const auto error = [&](ViewNumber number) { return errors[rig_number(side, number)]; };
  MirrorViewSettings s = view.settings();
  if (error(kK1) != 0 || error(kK2) != 0) {
    if (!s.distortion || s.distortion->coefficients.empty()) {
      const double focal_px = view.focal_length_px();
      s.distortion = {.coefficients = {0, 0, 0, 0},
                      .focal_px = {focal_px, focal_px},
                      .principal_px = s.lens_axis_px.value_or(s.centre_px)};
    }
    s.distortion->coefficients[0] += error(kK1);
    s.distortion->coefficients[1] += error(kK2);
  }
  s.centre_px += Eigen::Vector2d(error(kColumn), error(kRow));
  s.rim_radius_px += error(kRim);
  s.azimuth_rad += error(kAzimuth);
  s.tilt_rad += Eigen::Vector2d(error(kTiltX), error(kTiltY));
  s.axis_offset_m += Eigen::Vector2d(error(kOffsetX), error(kOffsetY));
  s.cone.apex_rad += error(kApex);
  s.cone.rim_radius_m += error(kMirrorRadius);
  s.cone.lens_to_tip_m += error(kLensToTip);
  s.lens_height_m += lens_height_error_m;
  return MirrorView(s);
}

}  // namespace

std::string rig_number_name(int number) {
  if (number == kLensHeight) return "lens_height_m";
  if (number == kSeparation) return "mirror_separation_m";
  return std::string(number < kViewNumbers ? "lower." : "upper.") + kViewNames[std::size_t(number % kViewNumbers)];
}

Eigen::VectorXd numbers_of(const Rig& rig) {
  Eigen::VectorXd numbers(kRigNumbers);
  for (const Side side : {Side::kLower, Side::kUpper}) {
    const MirrorViewSettings& s = of_view(rig, side).settings();
    const bool has_lens = s.distortion && s.distortion->coefficients.size() >= 2;
    const double k1 = has_lens ? s.distortion->coefficients[0] : 0;
    const double k2 = has_lens ? s.distortion->coefficients[1] : 0;
    numbers.segment<kViewNumbers>(rig_number(side, 0)) << s.centre_px, s.rim_radius_px, s.azimuth_rad, s.tilt_rad,
        s.axis_offset_m, s.cone.apex_rad, s.cone.rim_radius_m, s.cone.lens_to_tip_m, k1, k2;
  }
  numbers[kLensHeight] = rig.lower.settings().lens_height_m;
  numbers[kSeparation] = rig.mirror_separation_m();
  return numbers;
}

Rig with_errors(const Rig& rig, const Eigen::VectorXd& errors) {
  // The upper lens follows from the tips' separation and the distances from the lenses to the tips.
  const double upper_lens_m = errors[kLensHeight] + errors[rig_number(Side::kLower, kLensToTip)] + errors[kSeparation] -
                              errors[rig_number(Side::kUpper, kLensToTip)];
  return {with_errors(rig.lower, Side::kLower, errors, errors[kLensHeight]),
          with_errors(rig.upper, Side::kUpper, errors, upper_lens_m), rig.exposures};
}

UncertainRig::UncertainRig(Rig rig, BySharedErrors<kRigNumbers> by_shared)
    : rig_(std::move(rig)), by_shared_(std::move(by_shared)) {
  if (is_exact()) return;
  for (int number = 0; number < kRigNumbers; ++number) {
    if (by_shared_.row(number).isZero(0)) continue;
    const double step = step_of(number);
    const Rig less = with_errors(rig_, -step * Eigen::VectorXd::Unit(kRigNumbers, number));
    const Rig more = with_errors(rig_, step * Eigen::VectorXd::Unit(kRigNumbers, number));
    const bool is_of_upper = number >= kViewNumbers;
    const bool is_of_lower = number < kViewNumbers || number == kLensHeight;
    const bool moves_upper = is_of_upper || number == rig_number(Side::kLower, kLensToTip);
    if (is_of_lower) stepped_[0].push_back({number, step, {less.lower, more.lower}});
    if (moves_upper) stepped_[1].push_back({number, step, {less.upper, more.upper}});
  }
}

double UncertainRig::variance(Side side, ViewNumber number) const {
  return by_shared_.row(rig_number(side, number)).squaredNorm();
}

double UncertainRig::centre_variance_px2(Side side) const {
  return (variance(side, kColumn) + variance(side, kRow)) / 2;
}

double UncertainRig::edge_variance_px2(Side side) const { return variance(side, kRim) + centre_variance_px2(side); }

double UncertainRig::lean_variance_rad2(Side side, double radius_px) const {
  return (variance(side, kTiltX) + variance(side, kTiltY)) / 2 + centre_variance_px2(side) / (radius_px * radius_px);
}

BySharedErrors<2> UncertainRig::pixel_by_shared(Side side, const Eigen::Vector2d& p_BL_m, double radius_m,
                                                double top_m) const {
  BySharedErrors<2> effect = BySharedErrors<2>::Zero(2, errors());
  const auto pixel_of = [&](const MirrorView& view) -> std::optional<Eigen::Vector2d> {
    const auto near_m = near_top_point(view, p_BL_m, radius_m, top_m);
    if (!near_m) return std::nullopt;
    const auto shown = view.project_with_jacobian(*near_m, Rim::kGoesOn);
    return shown ? std::optional(shown->pixel_px) : std::nullopt;
  };
  for (const Stepped& s : stepped_[std::size_t(side)]) {
    const auto less_px = pixel_of(s.views[0]);
    const auto more_px = pixel_of(s.views[1]);
    if (!less_px || !more_px) continue;
    effect += (*more_px - *less_px) / (2 * s.step) * by_shared_.row(s.number);
  }
  return effect;
}

BySharedErrors<2> UncertainRig::place_by_shared(Side side, const Eigen::Vector2d& p_BL_m, const Landmark& landmark,
                                                const BySharedErrors<kLandmarkNumbers>& by_landmark) const {
  BySharedErrors<2> effect = BySharedErrors<2>::Zero(2, std::max(errors(), by_landmark.cols()));
  const MirrorView& view = of_view(rig_, side);
  const auto near_m = near_top_point(view, p_BL_m, landmark.radius_m, landmark.top_m);
  const auto shown = near_m ? view.project_with_jacobian(*near_m, Rim::kGoesOn) : std::nullopt;
  const double range_m = p_BL_m.norm();
  if (!shown || !(range_m > 0)) return effect;
  const Eigen::Vector2d from_axis = p_BL_m - view.settings().axis_offset_m;
  const Eigen::Vector2d e = from_axis.normalized();
  if (!is_exact()) effect += pixel_by_shared(side, p_BL_m, landmark.radius_m, landmark.top_m);
  if (by_landmark.cols() > 0) {
    effect += shown->jacobian.col(2) * by_landmark.row(kTop);
    effect -= shown->jacobian.leftCols<2>() * e * by_landmark.row(kRadius);
  }
  // The near point rotates about the view's axis as the landmark moves sideways: I - (r / D) (I - e e^T).
  const double share = landmark.radius_m / from_axis.norm();
  const Eigen::Matrix2d near_by_axis = (1 - share) * Eigen::Matrix2d::Identity() + share * e * e.transpose();
  const Eigen::Vector2d outwards = p_BL_m / range_m;
  Eigen::Matrix2d by_place;  // of the axis, by range and bearing
  by_place << outwards.x(), -p_BL_m.y(), outwards.y(), p_BL_m.x();
  const Eigen::Matrix2d pixel_by_place = shown->jacobian.leftCols<2>() * near_by_axis * by_place;
  return pixel_by_place.inverse() * effect;
}

}  // namespace twocone::vision

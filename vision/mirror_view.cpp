// SPDX-License-Identifier: Apache-2.0
#include "vision/mirror_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "base/errors.h"
#include "base/plane.h"

namespace twocone::vision {
namespace {

// Newton's error after a step is of the order of the step's square. After a step of 1e-9 (relative) it is far below a
// double's rounding, 1e-16, unless the curvature of the model is some hundred times its slope.
constexpr double kLastStep = 1e-9;

void check(const LensDistortion& distortion) {
  base::Complaints bad;
  const std::size_t terms = distortion.coefficients.size();
  bad.require(terms == 4 || terms == 5 || terms == 8, "distortion has {} coefficients, must have 4, 5 or 8", terms);
  for (std::size_t i = 0; i < terms; ++i) {
    const double k = distortion.coefficients[i];
    bad.require(std::isfinite(k), "distortion coefficient {} is {}, must be a finite number", i, k);
  }
  for (const int i : {0, 1}) {
    const double focal = distortion.focal_px[i];
    const double principal = distortion.principal_px[i];
    bad.require_field(base::is_positive(focal), i == 0 ? "distortion focal_px x" : "distortion focal_px y", focal,
                      "> 0 px");
    bad.require_field(std::isfinite(principal), i == 0 ? "distortion principal_px x" : "distortion principal_px y",
                      principal, "a finite number of px");
  }
  bad.raise("Lens");
}

// A point on the rim must not fall outside it by the rounding of project() or of the caller's own arithmetic.
constexpr double kRimSlack = 1 + 16 * std::numeric_limits<double>::epsilon();
// The lens and its inverse add some ten roundings of coordinates a few times as large as the radius.
constexpr double kRimSlackBehindLens = 1 + 256 * std::numeric_limits<double>::epsilon();
constexpr double kMostTilt_rad = std::numbers::pi / 4;

void check(const MirrorViewSettings& s) {
  base::Complaints bad;
  bad.require_field(s.cone.apex_rad > 0 && s.cone.apex_rad < std::numbers::pi, "cone.apex_rad", s.cone.apex_rad,
                    "between 0 and pi rad");
  bad.require_field(base::is_positive(s.cone.rim_radius_m), "cone.rim_radius_m", s.cone.rim_radius_m, "> 0 m");
  bad.require_field(base::is_positive(s.cone.lens_to_tip_m), "cone.lens_to_tip_m", s.cone.lens_to_tip_m, "> 0 m");
  bad.require_field(std::isfinite(s.lens_height_m), "lens_height_m", s.lens_height_m, "a finite number of m");
  bad.require_field(std::isfinite(s.centre_px.x()), "centre_px column", s.centre_px.x(), "a finite number of px");
  bad.require_field(std::isfinite(s.centre_px.y()), "centre_px row", s.centre_px.y(), "a finite number of px");
  bad.require_field(base::is_positive(s.rim_radius_px), "rim_radius_px", s.rim_radius_px, "> 0 px");
  bad.require_field(std::isfinite(s.azimuth_rad), "azimuth_rad", s.azimuth_rad, "a finite number of rad");
  for (const int i : {0, 1}) {
    const bool is_x = i == 0;
    bad.require_field(std::abs(s.tilt_rad[i]) < kMostTilt_rad, is_x ? "tilt_rad about x" : "tilt_rad about y",
                      s.tilt_rad[i], "within a quarter of pi rad either way");
    bad.require_field(std::isfinite(s.axis_offset_m[i]), is_x ? "axis_offset_m x" : "axis_offset_m y",
                      s.axis_offset_m[i], "a finite number of m");
  }
  bad.raise("MirrorView");
}

}  // namespace

Lens::Lens(const LensDistortion& distortion)
    : focal_px_(distortion.focal_px.array()), principal_px_(distortion.principal_px.array()) {
  check(distortion);
  std::copy(distortion.coefficients.begin(), distortion.coefficients.end(), k_.begin());
}

std::optional<Lens::Bent> Lens::bend(const Eigen::Vector2d& straight) const {
  const auto& [k1, k2, p1, p2, k3, k4, k5, k6] = k_;
  const double x = straight.x();
  const double y = straight.y();
  const double rr = x * x + y * y;
  const double above = 1 + rr * (k1 + rr * (k2 + rr * k3));
  const double below = 1 + rr * (k4 + rr * (k5 + rr * k6));
  if (!(below > 0) || !std::isfinite(above)) return std::nullopt;
  const double scale = above / below;
  // d scale / d rr
  const double growth = (k1 + rr * (2 * k2 + 3 * rr * k3) - scale * (k4 + rr * (2 * k5 + 3 * rr * k6))) / below;

  Bent bent;
  bent.at = {x * scale + 2 * p1 * x * y + p2 * (rr + 2 * x * x), y * scale + p1 * (rr + 2 * y * y) + 2 * p2 * x * y};
  const double mixed = 2 * x * y * growth + 2 * p1 * x + 2 * p2 * y;
  bent.jacobian << scale + 2 * x * x * growth + 2 * p1 * y + 6 * p2 * x, mixed,  //
      mixed, scale + 2 * y * y * growth + 6 * p1 * y + 2 * p2 * x;
  // At a fold the sign of the determinant changes; radially beyond it, the sign of the trace changes too.
  if (!(bent.jacobian.determinant() > 0) || !(bent.jacobian.trace() > 0)) return std::nullopt;
  return bent;
}

std::optional<Eigen::Vector2d> Lens::distort(const Eigen::Vector2d& pinhole_px) const {
  const auto answer = distort_with_jacobian(pinhole_px);
  return answer ? std::optional(answer->pixel_px) : std::nullopt;
}

std::optional<PixelWithJacobian<2>> Lens::distort_with_jacobian(const Eigen::Vector2d& pinhole_px) const {
  const auto bent = bend(((pinhole_px.array() - principal_px_) / focal_px_).matrix());
  if (!bent) return std::nullopt;
  PixelWithJacobian<2> answer{(principal_px_ + focal_px_ * bent->at.array()).matrix(), bent->jacobian};
  answer.jacobian(0, 1) *= focal_px_.x() / focal_px_.y();
  answer.jacobian(1, 0) *= focal_px_.y() / focal_px_.x();
  return answer;
}

std::optional<Eigen::Vector2d> Lens::undistort(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d wanted = ((pixel.array() - principal_px_) / focal_px_).matrix();
  if (!wanted.allFinite()) return std::nullopt;
  Eigen::Vector2d straight = wanted;
  auto bent = bend(straight);
  // The start may lie beyond the fold although the answer does not: move it towards the middle.
  for (int i = 0; !bent && i < kSteps; ++i) bent = bend(straight *= 0.75);

  for (int i = 0; bent && i < kSteps; ++i) {
    Eigen::Vector2d step = bent->jacobian.inverse() * (wanted - bent->at);
    if (!step.allFinite()) return std::nullopt;
    const bool is_last = step.norm() <= kLastStep * (wanted.norm() + straight.norm());
    if (is_last) return (principal_px_ + focal_px_ * (straight + step).array()).matrix();
    auto next = bend(straight + step);
    for (int halving = 0; !next && halving < kSteps; ++halving) next = bend(straight + (step /= 2));
    straight += step;
    bent = next;
  }
  return std::nullopt;
}

double focal_length_px(const ConeMirror& cone, double rim_radius_px) {
  return (cone.lens_to_tip_m / cone.rim_radius_m + 1 / std::tan(cone.apex_rad / 2)) * rim_radius_px;
}

MirrorView::MirrorView(const MirrorViewSettings& settings) : settings_(settings) {
  check(settings);
  const ConeMirror& cone = settings.cone;
  sin_apex_ = std::sin(cone.apex_rad);
  cos_apex_ = std::cos(cone.apex_rad);
  tan_half_ = std::tan(cone.apex_rad / 2);
  focal_length_px_ = vision::focal_length_px(cone, settings.rim_radius_px);
  cos_azimuth_ = std::cos(settings.azimuth_rad);
  sin_azimuth_ = std::sin(settings.azimuth_rad);
  if (settings.distortion) {
    const Lens lens(*settings.distortion);
    // If all coefficients are 0, both directions would only add roundings.
    if (std::ranges::any_of(settings.distortion->coefficients, [](double k) { return k != 0; })) lens_ = lens;
  }
  is_moved_ = !settings.tilt_rad.isZero(0) || !settings.axis_offset_m.isZero(0);
  rotation_ = (Eigen::AngleAxisd(settings.tilt_rad.y(), Eigen::Vector3d::UnitY()) *
               Eigen::AngleAxisd(settings.tilt_rad.x(), Eigen::Vector3d::UnitX()))
                  .toRotationMatrix();
}

Eigen::Vector3d MirrorView::lens_m() const {
  return {settings_.axis_offset_m.x(), settings_.axis_offset_m.y(), settings_.lens_height_m};
}

Eigen::Vector3d MirrorView::tip_m() const {
  return lens_m() + rotation_ * Eigen::Vector3d(0, 0, settings_.cone.lens_to_tip_m);
}

Eigen::Vector3d MirrorView::to_unit(const Eigen::Vector3d& p_BQ_m) const {
  if (!is_moved_) return p_BQ_m;
  return rotation_.transpose() * (p_BQ_m - lens_m()) + Eigen::Vector3d(0, 0, settings_.lens_height_m);
}

double MirrorView::elevation_rad(double radius_px) const {
  return std::numbers::pi / 2 - settings_.cone.apex_rad + std::atan(radius_px / focal_length_px_);
}

std::optional<double> MirrorView::image_radius_px(double distance_m, double height_m, Rim rim) const {
  if (!std::isfinite(distance_m) || !std::isfinite(height_m) || distance_m < 0) return std::nullopt;
  const double d = settings_.cone.lens_to_tip_m;
  const double from_v_out = distance_m + d * sin_apex_;
  const double from_v_up = (height_m - settings_.lens_height_m) - d * (1 - cos_apex_);
  const double across = sin_apex_ * from_v_up - cos_apex_ * from_v_out;
  const double along = cos_apex_ * from_v_up + sin_apex_ * from_v_out;
  if (!(across > 0) || !(along > 0)) return std::nullopt;

  const double slope = across / along;  // h / v
  const double radius_px = focal_length_px_ * slope;
  if (rim == Rim::kEnds && !(radius_px <= settings_.rim_radius_px * kRimSlack)) return std::nullopt;
  if (!(slope < tan_half_)) return std::nullopt;                     // along the cone's side
  const double hit_m = d * tan_half_ * slope / (tan_half_ - slope);  // where on the cone the ray is reflected
  // Values near the limits of a double overflow on the way to the result; a NaN fails the comparison.
  if (!(distance_m >= hit_m) || !(radius_px > 0) || !std::isfinite(radius_px)) return std::nullopt;
  return radius_px;
}

std::optional<Eigen::Vector2d> MirrorView::project(const Eigen::Vector3d& p_BQ_m) const {
  const Eigen::Vector3d p_UQ_m = to_unit(p_BQ_m);
  const double distance_m = std::hypot(p_UQ_m.x(), p_UQ_m.y());
  if (distance_m == 0) return std::nullopt;
  const auto radius_px = image_radius_px(distance_m, p_UQ_m.z());
  if (!radius_px) return std::nullopt;
  const auto pixel = distort_px(settings_.centre_px + offset_px(std::atan2(p_UQ_m.y(), p_UQ_m.x()), *radius_px));
  return pixel && pixel->allFinite() ? pixel : std::nullopt;
}

std::optional<PixelWithJacobian<3>> MirrorView::project_with_jacobian(const Eigen::Vector3d& p_BQ_m, Rim rim) const {
  const Eigen::Vector3d p_UQ_m = to_unit(p_BQ_m);
  const double distance_m = std::hypot(p_UQ_m.x(), p_UQ_m.y());
  if (distance_m == 0) return std::nullopt;
  const auto radius_px = image_radius_px(distance_m, p_UQ_m.z(), rim);
  if (!radius_px) return std::nullopt;

  const double d = settings_.cone.lens_to_tip_m;
  const double from_v_out = distance_m + d * sin_apex_;
  const double from_v_up = (p_UQ_m.z() - settings_.lens_height_m) - d * (1 - cos_apex_);
  const double along = cos_apex_ * from_v_up + sin_apex_ * from_v_out;
  // From h = v across / along, the quotient rule gives (dh/drho, dh/dz) = v (-from_v_up, from_v_out) / along^2.
  const double radius_per_out = -focal_length_px_ * from_v_up / (along * along);
  const double radius_per_up = focal_length_px_ * from_v_out / (along * along);

  const Eigen::Vector2d outwards(p_UQ_m.x() / distance_m, p_UQ_m.y() / distance_m);
  const double sense = settings_.mirrored ? -1 : 1;
  // This is offset_px(bearing, 1) without computing angles.
  const Eigen::Vector2d in_image(cos_azimuth_ * outwards.x() + sin_azimuth_ * outwards.y(),
                                 sense * (cos_azimuth_ * outwards.y() - sin_azimuth_ * outwards.x()));
  const Eigen::Vector2d across_image(-sense * in_image.y(), sense * in_image.x());  // direction of growing bearing
  PixelWithJacobian<3> answer;
  answer.pixel_px = settings_.centre_px + *radius_px * in_image;
  answer.jacobian.leftCols<2>() =
      radius_per_out * in_image * outwards.transpose() +
      (*radius_px / distance_m) * across_image * Eigen::RowVector2d(-outwards.y(), outwards.x());
  answer.jacobian.col(2) = radius_per_up * in_image;
  if (is_moved_) answer.jacobian *= rotation_.transpose();
  if (lens_) {
    const auto distorted = lens_->distort_with_jacobian(answer.pixel_px);
    if (!distorted) return std::nullopt;
    answer.pixel_px = distorted->pixel_px;
    answer.jacobian = distorted->jacobian * answer.jacobian;
  }
  return answer;
}

std::optional<Eigen::Vector2d> MirrorView::distort_px(const Eigen::Vector2d& undistorted_px) const {
  return lens_ ? lens_->distort(undistorted_px) : undistorted_px;
}

std::optional<Eigen::Vector2d> MirrorView::undistort_px(const Eigen::Vector2d& pixel) const {
  return lens_ ? lens_->undistort(pixel) : pixel;
}

std::optional<Ray> MirrorView::back_project(const Eigen::Vector2d& pixel, Rim rim) const {
  const auto undistorted_px = undistort_px(pixel);
  if (!undistorted_px) return std::nullopt;
  const Eigen::Vector2d offset = *undistorted_px - settings_.centre_px;
  const double radius_px = std::hypot(offset.x(), offset.y());
  const double slack = lens_ ? kRimSlackBehindLens : kRimSlack;
  if (!(radius_px > 0) || !std::isfinite(radius_px)) return std::nullopt;
  if (rim == Rim::kEnds && !(radius_px <= settings_.rim_radius_px * slack)) return std::nullopt;

  const double slope = radius_px / focal_length_px_;
  if (!(slope < tan_half_)) return std::nullopt;
  const double d = settings_.cone.lens_to_tip_m;
  const double hit_up_m = d * tan_half_ / (tan_half_ - slope);
  const double hit_out_m = hit_up_m * slope;
  // The lens's ray, of direction (slope, 1), is reflected at the cone's side (sin a, cos a).
  const double out = sin_apex_ - cos_apex_ * slope;
  const double up = cos_apex_ + sin_apex_ * slope;
  const double bearing = bearing_rad(offset);
  const Eigen::Vector3d outwards(std::cos(bearing), std::sin(bearing), 0);
  const Eigen::Vector3d upwards(0, 0, 1);
  const Eigen::Vector3d direction = (outwards * out + upwards * up).normalized();
  const Ray ray = is_moved_
                      ? Ray{lens_m() + rotation_ * (outwards * hit_out_m + upwards * hit_up_m), rotation_ * direction}
                      : Ray{outwards * hit_out_m + upwards * (settings_.lens_height_m + hit_up_m), direction};
  if (!ray.origin_m.allFinite() || !ray.direction.allFinite()) return std::nullopt;
  return ray;
}

double MirrorView::bearing_rad(const Eigen::Vector2d& offset_px) const {
  const double turn = std::atan2(offset_px.y(), offset_px.x());
  return base::wrap_angle_rad(settings_.azimuth_rad + (settings_.mirrored ? -turn : turn));
}

Eigen::Vector2d MirrorView::offset_px(double bearing_rad, double radius_px) const {
  const double turn = (bearing_rad - settings_.azimuth_rad) * (settings_.mirrored ? -1 : 1);
  return {radius_px * std::cos(turn), radius_px * std::sin(turn)};
}

std::string_view to_string(Side side) { return side == Side::kLower ? "lower" : "upper"; }

double Rig::mirror_separation_m() const {
  const auto tip_height = [](const MirrorView& view) {
    return view.settings().lens_height_m + view.settings().cone.lens_to_tip_m;
  };
  return tip_height(upper) - tip_height(lower);
}

}  // namespace twocone::vision

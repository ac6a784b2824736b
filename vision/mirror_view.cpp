// SPDX-License-Identifier: Apache-2.0
#include "vision/mirror_view.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

namespace twocone::vision {
namespace {

// A point on the rim itself must not fall outside it by the rounding of project() or of a caller's own arithmetic.
constexpr double kRimSlack = 1 + 16 * std::numeric_limits<double>::epsilon();

double wrap(double angle_rad) {
  return std::abs(angle_rad) <= std::numbers::pi ? angle_rad : std::atan2(std::sin(angle_rad), std::cos(angle_rad));
}

void check(const MirrorViewSettings& s) {
  std::string bad;
  const auto require = [&bad](bool good, const char* field, double value, const char* rule) {
    if (!good) bad += fmt::format(" {} is {}, must be {};", field, value, rule);
  };
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  require(s.cone.apex_rad > 0 && s.cone.apex_rad < std::numbers::pi, "cone.apex_rad", s.cone.apex_rad,
          "between 0 and pi rad");
  require(positive(s.cone.rim_radius_m), "cone.rim_radius_m", s.cone.rim_radius_m, "> 0 m");
  require(positive(s.cone.lens_to_tip_m), "cone.lens_to_tip_m", s.cone.lens_to_tip_m, "> 0 m");
  require(std::isfinite(s.lens_height_m), "lens_height_m", s.lens_height_m, "a finite number of m");
  require(std::isfinite(s.centre_px.x()), "centre_px column", s.centre_px.x(), "a finite number of px");
  require(std::isfinite(s.centre_px.y()), "centre_px row", s.centre_px.y(), "a finite number of px");
  require(positive(s.rim_radius_px), "rim_radius_px", s.rim_radius_px, "> 0 px");
  require(std::isfinite(s.azimuth_rad), "azimuth_rad", s.azimuth_rad, "a finite number of rad");
  if (!bad.empty()) throw std::invalid_argument("MirrorView:" + bad);
}

}  // namespace

MirrorView::MirrorView(const MirrorViewSettings& settings) : settings_(settings) {
  check(settings);
  const ConeMirror& cone = settings.cone;
  sin_apex_ = std::sin(cone.apex_rad);
  cos_apex_ = std::cos(cone.apex_rad);
  tan_half_ = std::tan(cone.apex_rad / 2);
  focal_length_px_ = (cone.lens_to_tip_m / cone.rim_radius_m + 1 / tan_half_) * settings.rim_radius_px;
}

std::optional<double> MirrorView::image_radius_px(double distance_m, double height_m) const {
  if (!std::isfinite(distance_m) || !std::isfinite(height_m) || distance_m < 0) return std::nullopt;
  const double d = settings_.cone.lens_to_tip_m;
  const double from_v_out = distance_m + d * sin_apex_;
  const double from_v_up = (height_m - settings_.lens_height_m) - d * (1 - cos_apex_);
  const double across = sin_apex_ * from_v_up - cos_apex_ * from_v_out;
  const double along = cos_apex_ * from_v_up + sin_apex_ * from_v_out;
  if (!(across > 0) || !(along > 0)) return std::nullopt;

  const double slope = across / along;  // h / v
  const double radius_px = focal_length_px_ * slope;
  if (!(radius_px <= settings_.rim_radius_px * kRimSlack)) return std::nullopt;
  const double hit_m = d * tan_half_ * slope / (tan_half_ - slope);  // where on the cone the ray is reflected
  if (distance_m < hit_m) return std::nullopt;
  return radius_px;
}

std::optional<Eigen::Vector2d> MirrorView::project(const Eigen::Vector3d& p_BQ_m) const {
  const double distance_m = std::hypot(p_BQ_m.x(), p_BQ_m.y());
  if (distance_m == 0) return std::nullopt;
  const auto radius_px = image_radius_px(distance_m, p_BQ_m.z());
  if (!radius_px) return std::nullopt;
  return settings_.centre_px + offset_px(std::atan2(p_BQ_m.y(), p_BQ_m.x()), *radius_px);
}

std::optional<Ray> MirrorView::back_project(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d offset = pixel - settings_.centre_px;
  const double radius_px = std::hypot(offset.x(), offset.y());
  if (!(radius_px > 0) || !(radius_px <= settings_.rim_radius_px * kRimSlack)) return std::nullopt;

  const double slope = radius_px / focal_length_px_;
  const double d = settings_.cone.lens_to_tip_m;
  const double hit_up_m = d * tan_half_ / (tan_half_ - slope);
  const double hit_out_m = hit_up_m * slope;
  // The lens's ray, of direction (slope, 1), mirrored in the cone's side (sin a, cos a).
  const double out = sin_apex_ - cos_apex_ * slope;
  const double up = cos_apex_ + sin_apex_ * slope;
  const double bearing = bearing_rad(offset);
  const Eigen::Vector3d outwards(std::cos(bearing), std::sin(bearing), 0);
  const Eigen::Vector3d upwards(0, 0, 1);
  return Ray{outwards * hit_out_m + upwards * (settings_.lens_height_m + hit_up_m),
             (outwards * out + upwards * up).normalized()};
}

double MirrorView::bearing_rad(const Eigen::Vector2d& offset_px) const {
  const double turn = std::atan2(offset_px.y(), offset_px.x());
  return wrap(settings_.azimuth_rad + (settings_.mirrored ? -turn : turn));
}

Eigen::Vector2d MirrorView::offset_px(double bearing_rad, double radius_px) const {
  const double turn = (bearing_rad - settings_.azimuth_rad) * (settings_.mirrored ? -1 : 1);
  return {radius_px * std::cos(turn), radius_px * std::sin(turn)};
}

double Rig::mirror_separation_m() const {
  const auto tip_height = [](const MirrorView& view) {
    return view.settings().lens_height_m + view.settings().cone.lens_to_tip_m;
  };
  return tip_height(upper) - tip_height(lower);
}

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#include "vision/dense/panorama.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <opencv2/imgproc.hpp>

#include "base/errors.h"
#include "base/plane.h"

namespace twocone::vision {
namespace {

// What is between this and kInnermost_px is not ranged, but the windows of what is ranged may reach into it.
constexpr double kContext_px = 10;
// Pixels nearer to the rim's circle than this are mixtures with what is beyond it, by interpolation and by a blurred
// lens.
constexpr double kMixedRim_px = 2;
// Beyond this elevation one circle of the image would be very many steps of slope.
constexpr double kSteepest_rad = 75 * std::numbers::pi / 180;
constexpr float kNowhere = -10;  // outside the image, also for bilinear neighbours

struct Elevations {
  double low_rad, high_rad;
};
Elevations elevations_of(const MirrorView& view) {
  return {view.elevation_rad(kContext_px), view.elevation_rad(view.settings().rim_radius_px - kMixedRim_px)};
}

}  // namespace

double PanoramaGrid::bearing_rad(int azimuth) const {
  return -std::numbers::pi + 2 * std::numbers::pi * (azimuth + 0.5) / azimuths;
}

Eye eye_of(const MirrorView& view) {
  const auto& [apex_rad, rim_radius_m, lens_to_tip_m] = view.settings().cone;
  return {lens_to_tip_m * std::sin(apex_rad), view.settings().lens_height_m + lens_to_tip_m * (1 - std::cos(apex_rad))};
}

PanoramaGrid grid_of(const Rig& rig, int azimuths) {
  const Elevations lower = elevations_of(rig.lower);
  const Elevations upper = elevations_of(rig.upper);
  const double low_rad = std::min(lower.low_rad, upper.low_rad);
  const double high_rad = std::max(lower.high_rad, upper.high_rad);
  base::Complaints bad;
  bad.require(rig.lower.settings().rim_radius_px > 2 * kInnermost_px, "lower rim_radius_px is {}, must be > {}",
              rig.lower.settings().rim_radius_px, 2 * kInnermost_px);
  bad.require(rig.upper.settings().rim_radius_px > 2 * kInnermost_px, "upper rim_radius_px is {}, must be > {}",
              rig.upper.settings().rim_radius_px, 2 * kInnermost_px);
  bad.require(std::max(std::abs(low_rad), std::abs(high_rad)) < kSteepest_rad,
              "the mirrors see from {:.1f} to {:.1f} degrees of elevation, must be within 75 degrees of the horizon",
              low_rad * 180 / std::numbers::pi, high_rad * 180 / std::numbers::pi);
  bad.require(lower.low_rad < upper.high_rad && upper.low_rad < lower.high_rad,
              "the mirrors have no elevation in common");
  bad.raise("DenseRanging");
  const double middle_px = rig.lower.settings().rim_radius_px / 2;
  const double step =
      std::tan(rig.lower.elevation_rad(middle_px + 0.5)) - std::tan(rig.lower.elevation_rad(middle_px - 0.5));
  const int slopes = 2 * static_cast<int>(std::floor((std::tan(high_rad) - std::tan(low_rad)) / step / 2));
  return {azimuths, slopes, std::tan(low_rad), step};
}

PanoramaView::PanoramaView(const MirrorView& view, const PanoramaGrid& grid, double reference_m, cv::Size size,
                           const cv::Mat& own_body)
    : slopes_(grid.slopes) {
  const int azimuths = grid.azimuths;
  cv::Mat columns(azimuths, slopes_, CV_32F, cv::Scalar(kNowhere));
  cv::Mat rows(azimuths, slopes_, CV_32F, cv::Scalar(kNowhere));
  cv::Mat shown(azimuths, slopes_, CV_8U, cv::Scalar(0));
  rays_.assign(std::size_t(azimuths) * std::size_t(slopes_), {});
  std::vector<double> radii_px(std::size_t(slopes_), 0);
  std::vector<int> count(std::size_t(slopes_), 0);
  const Eye eye = eye_of(view);
  for (int azimuth = 0; azimuth < azimuths; ++azimuth) {
    const double bearing_rad = grid.bearing_rad(azimuth);
    const Eigen::Vector2d along(std::cos(bearing_rad), std::sin(bearing_rad));
    const Eigen::Vector2d left(-along.y(), along.x());
    for (int i = 0; i < slopes_; ++i) {
      const Eigen::Vector2d place_m = reference_m * along;
      const double height_m = eye.height_m + grid.slope(i) * (reference_m + eye.behind_m);
      // Cells beyond the rim and near the tip have rays, too: those of neighbours are interpolated.
      const auto shown_at = view.project_with_jacobian({place_m.x(), place_m.y(), height_m}, Rim::kGoesOn);
      if (!shown_at) continue;
      const Eigen::Vector2d& pixel = shown_at->pixel_px;
      const auto undistorted = view.undistort_px(pixel);
      const auto ray = view.back_project(pixel, Rim::kGoesOn);
      if (!undistorted || !ray) continue;
      const double radius_px = (*undistorted - view.settings().centre_px).norm();
      const bool is_inside =
          pixel.x() >= 1 && pixel.y() >= 1 && pixel.x() <= size.width - 2 && pixel.y() <= size.height - 2;
      if (is_inside && radius_px >= kContext_px / 2 && radius_px <= view.settings().rim_radius_px - kMixedRim_px) {
        columns.at<float>(azimuth, i) = static_cast<float>(pixel.x());
        rows.at<float>(azimuth, i) = static_cast<float>(pixel.y());
        if (radius_px >= kInnermost_px) shown.at<std::uint8_t>(azimuth, i) = 255;
      }
      const Eigen::Vector2d from_m = ray->origin_m.head<2>();
      const double forward = ray->direction.head<2>().dot(along);
      const double slope = ray->direction.z() / forward;
      const double left_slope = ray->direction.head<2>().dot(left) / forward;
      const double from_along_m = from_m.dot(along);
      rays_[std::size_t(azimuth) * std::size_t(slopes_) + std::size_t(i)] = {
          static_cast<float>(ray->origin_m.z() - slope * from_along_m), static_cast<float>(slope),
          static_cast<float>(from_m.dot(left) - left_slope * from_along_m), static_cast<float>(left_slope)};
      radii_px[std::size_t(i)] += radius_px;
      ++count[std::size_t(i)];
    }
  }
  for (std::size_t i = 0; i < radii_px.size(); ++i) {
    const double mean_px = count[i] > 0 ? radii_px[i] / count[i] : kInnermost_px;
    widths_px_.push_back(static_cast<float>(2 * std::numbers::pi * mean_px / azimuths));
  }
  cv::convertMaps(with_seam(columns), with_seam(rows), places_, fractions_, CV_16SC2);
  cv::Mat own(azimuths, slopes_, CV_8U, cv::Scalar(0));
  if (!own_body.empty()) {
    // A cell that touches the robot with one of its neighbours is the robot's.
    cv::Mat wide;
    cv::dilate(own_body != 0, wide, cv::Mat());
    cv::remap(wide, own, columns, rows, cv::INTER_NEAREST);
    own.setTo(0, shown == 0);
    shown.setTo(0, own);
  }
  shown_ = with_seam(shown);
  own_body_ = with_seam(own);
}

cv::Mat PanoramaView::resample(const cv::Mat& image) const {
  cv::Mat panorama;
  cv::remap(image, panorama, places_, fractions_, cv::INTER_LINEAR);
  return panorama;
}

PlaneRay PanoramaView::ray(int azimuth, float index) const {
  const int first = std::clamp(static_cast<int>(index), 0, slopes_ - 2);
  const float share = index - static_cast<float>(first);
  const PlaneRay* const cell = &rays_[std::size_t(azimuth) * std::size_t(slopes_) + std::size_t(first)];
  const auto between = [share](float a, float b) { return a + share * (b - a); };
  return {between(cell[0].height_m, cell[1].height_m), between(cell[0].slope, cell[1].slope),
          between(cell[0].left_m, cell[1].left_m), between(cell[0].left_slope, cell[1].left_slope)};
}

cv::Mat with_seam(const cv::Mat& azimuths) {
  cv::Mat wide;
  cv::vconcat(std::vector<cv::Mat>{azimuths.rowRange(azimuths.rows - kSeam, azimuths.rows), azimuths,
                                   azimuths.rowRange(0, kSeam)},
              wide);
  return wide;
}

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vision/dense_ranging.h"
#include "vision/mirror_view.h"

namespace twocone::vision {

/// Each panorama continues past its seam by so many azimuths at either end, so that windows and paths need not know of
/// the seam. Even.
constexpr int kSeam = 32;

/// The ray of a grid cell in the upright plane of its azimuth, where `along_m` is the horizontal distance from the
/// body's origin: height = height_m + slope along, and left of the plane by left_m + left_slope along.
struct PlaneRay {
  float height_m, slope, left_m, left_slope;
};

/// The point behind the axis from which an upright view sees the world, in the half-plane of an azimuth (V of
/// MirrorView).
struct Eye {
  double behind_m;  ///< horizontally, from the view's axis
  double height_m;  ///< over the floor
};
Eye eye_of(const MirrorView& view);

/// Returns the grid of a rig. @throws std::invalid_argument where the mirrors' slopes do not fit a grid
PanoramaGrid grid_of(const Rig& rig, int azimuths);

/// What the body's frame sees in one view: where the cells of a grid are in its image, and their rays.
class PanoramaView {
 public:
  /// @param reference_m distance from the body's origin at which tilts and offsets are exact
  PanoramaView(const MirrorView& view, const PanoramaGrid& grid, double reference_m, cv::Size size,
               const cv::Mat& own_body);

  /// Resamples an image of one channel to (azimuths + 2 kSeam) x slopes of the same type. Cells that are not shown have
  /// no meaning.
  [[nodiscard]] cv::Mat resample(const cv::Mat& image) const;

  /// CV_8U, of resample()'s size: 255 where the view shows the cell and not the robot.
  [[nodiscard]] const cv::Mat& shown() const { return shown_; }
  /// Likewise: 255 where the view shows the robot itself.
  [[nodiscard]] const cv::Mat& own_body() const { return own_body_; }
  /// Returns the ray of a cell, between two slopes. @param azimuth without the seam @param index in [0, slopes - 1]
  [[nodiscard]] PlaneRay ray(int azimuth, float index) const;
  /// Returns how many pixels of the image a cell is wide, across the radius, by slope index.
  [[nodiscard]] const std::vector<float>& widths_px() const { return widths_px_; }

 private:
  int slopes_;
  cv::Mat places_, fractions_;  ///< of cv::remap
  cv::Mat shown_, own_body_;
  std::vector<PlaneRay> rays_;  ///< azimuth by azimuth
  std::vector<float> widths_px_;
};

/// Returns a panorama without its seam.
inline cv::Mat without_seam(const cv::Mat& panorama) { return panorama.rowRange(kSeam, panorama.rows - kSeam); }
/// Returns a matrix of one row for each azimuth with the seam.
cv::Mat with_seam(const cv::Mat& azimuths);

}  // namespace twocone::vision

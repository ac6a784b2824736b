// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vision/rim.h"

namespace twocone::vision {

/// The rim's circle in the camera's picture, with what it can be trusted to.
struct RimMeasurement {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 0;
  double sigma_centre_px = 0;  ///< of column and of row
  double sigma_radius_px = 0;
  double scatter_px = 0;  ///< standard deviation of the single edges about the circle
  double support = 0;     ///< share of the directions whose edge lies on the circle, 0 to 1
};

/// Each pixel's median over the pictures of a drive, channel by channel: the world blurs, rim and mountings stay.
/// @param pictures CV_8UC3 of one size, at least one. @throws std::invalid_argument otherwise
cv::Mat median_picture(std::span<const cv::Mat> pictures);

/// The rim to sub-pixels. find_rim() tells about where; then along each direction, one for each pixel of the
/// circumference, the edge is where a sharp step between both sides' levels would have the brightness (linear light)
/// that is there: right for pixels that hold the share they cover, and without bias over many directions for those that
/// hold one point's colour. Directions without contrast, or where the picture ends close behind the rim, are left out.
///
/// Sigmas are those of the edges' scatter, two neighbouring edges taken as one, but not below kLeastRimSigma_px: a
/// camera that is not quite on the mirror's axis shows the rim a little off the tip, and no picture tells that from
/// noise.
/// @param rgb median_picture(), sRGB-coded. Nothing as in find_rim(). @throws std::invalid_argument as find_rim()
std::optional<RimMeasurement> measure_rim(const cv::Mat& rgb, const RimCircle& expected);
constexpr double kLeastRimSigma_px = 0.05;

constexpr double kLeastTipSigma_px = 0.1;

/// Where the mirror's tip is in the picture.
struct TipMeasurement {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< of column and of row
  std::size_t edges = 0;
};

/// The tip as the point where the pictures of upright edges meet: they are radial lines, so that an edge pixel p with
/// brightness gradient g has g . (p - tip) = 0. Least squares of all such pixels within `reach_px` of the tip, those
/// that look elsewhere weighed down. Edges of level things are arcs about the tip and left out by their direction.
///
/// A tilt t bends the lines: the answer is off by about t reach^2 / v (0.02 px for half a degree, 40 px and v 700 px).
/// In pictures without anti-aliasing edges are stairs, and the answer is off by up to 0.2 px: kLeastTipSigma_px.
/// A check on what calibrate() finds, not a part of it. Nothing where fewer than 100 edge pixels agree.
/// @param pictures CV_8UC3. @throws std::invalid_argument for another type or a reach that is not > 8
std::optional<TipMeasurement> measure_tip(std::span<const cv::Mat> pictures, const Eigen::Vector2d& expected_px,
                                          double reach_px);

}  // namespace twocone::vision

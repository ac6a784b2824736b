// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <span>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vision/mirror_view.h"

/// Finds a mirror's rim in the camera's image, roughly and to sub-pixels, and the point of its tip.
namespace twocone::vision {

/// The rim of a mirror as a circle in the image.
struct RimCircle {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 0;
  double support = 0;  ///< share of the directions from the centre whose edge lies within a pixel of the circle, 0 to 1
};

/// Returns the circle that fits a view's rim best in the camera's image, which its lens may bend: `centre_px` and
/// `rim_radius_px` of the view are those of the image without distortion.
RimCircle rim_in_image(const MirrorView& view);

/// The share of the expected radius within which a rim is searched, to either side.
constexpr double kRimSearch = 0.2;

/// Searches for the rim within `search_share` of `expected`'s radius about it: finds the strongest step of brightness
/// along each of 360 directions, then the circle that fits most of those edges (least squares, with less weight the
/// farther an edge is from the circle). Returns nothing where no circle agrees with more than a third of the directions
/// (an even background, an image without mirror).
///
/// Edges at which the image gets dark and stays dark to the end of the search count only where the others make no
/// circle. An image may hold only the mirror and its nearest surroundings, and the end of these is not the rim; but a
/// rim may also have a dark background.
///
/// The accuracy is sub-pixel where the step is sharp, but it depends on the contrast between rim and background: this
/// is a check, not a calibration.
/// @param rgb CV_8UC3. @throws std::invalid_argument for another type, an `expected.radius_px` that is not > 0, numbers
/// of `expected` that are not finite, and a `search_share` outside (0, 1)
std::optional<RimCircle> find_rim(const cv::Mat& rgb, const RimCircle& expected, double search_share = kRimSearch);

/// Returns whether brightness changes clearly, by 12 grey levels, in a third of the directions in which find_rim()
/// searches. Edges where the image gets dark to the end of the search do not count. If this is false, no conclusion
/// follows from a rim that is not found: it may be present without contrast to its background.
/// @throws as find_rim()
bool rim_may_show(const cv::Mat& rgb, const RimCircle& expected);

/// The rim's circle in the camera's image, with its accuracy.
struct RimMeasurement {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 0;
  double sigma_centre_px = 0;  ///< of column and of row
  double sigma_radius_px = 0;
  double scatter_px = 0;  ///< standard deviation of the single edges about the circle
  double support = 0;     ///< share of the directions whose edge lies on the circle, 0 to 1
};

/// Returns each pixel's median over the images of a drive, channel by channel. The surroundings blur, while the rim and
/// its mountings remain.
/// @param images CV_8UC3 of one size, at least one. @throws std::invalid_argument otherwise
cv::Mat median_image(std::span<const cv::Mat> images);

/// Measures the rim to sub-pixels. find_rim() gives the approximate circle. Then, along each direction (one for each
/// pixel of the circumference), the edge is placed so that a sharp step between the levels of both sides has the
/// observed mean brightness (linear light). This is correct for pixels that are means over their area, and unbiased
/// over many directions for pixels that hold the colour of one point. Directions without contrast, or where the image
/// ends close behind the rim, are left out.
///
/// Sigmas are those of the edges' scatter, two neighbouring edges counted as one, but not below kLeastRimSigma_px: a
/// camera that is slightly off the mirror's axis shows the rim a little off the tip, and no image can distinguish that
/// from noise.
/// @param rgb median_image(), sRGB-coded
/// @returns nothing where find_rim() gives nothing. @throws std::invalid_argument as find_rim()
std::optional<RimMeasurement> measure_rim(const cv::Mat& rgb, const RimCircle& expected,
                                          double search_share = kRimSearch);
constexpr double kLeastRimSigma_px = 0.05;

constexpr double kLeastTipSigma_px = 0.1;

/// Returns how far from its expected place the tip of a mirror is searched: a sixth of the rim's radius, because
/// farther out a tilt bends the lines, and 20 px at the least.
inline double tip_reach_px(double rim_radius_px) { return std::max(20.0, rim_radius_px / 6); }

/// The position of the mirror's tip in the image.
struct TipMeasurement {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< of column and of row
  std::size_t edges = 0;
};

/// Measures the tip as the point where the images of upright edges meet. These images are radial lines, so an edge
/// pixel p with brightness gradient g has g . (p - tip) = 0. The answer is the least-squares solution for all such
/// pixels within `reach_px` of the tip; pixels whose line misses the tip are left out. Horizontal edges are arcs about
/// the tip and are left out by their direction.
///
/// A tilt t bends the lines: the answer is off by about t reach^2 / v (0.02 px for half a degree, 40 px and v 700 px).
/// In images without anti-aliasing edges are stairs, and the answer is off by up to 0.2 px: kLeastTipSigma_px.
/// The answer checks the result of calibrate() and is not a part of it. Returns nothing where fewer than 100 edge
/// pixels agree.
/// @param images CV_8UC3. @throws std::invalid_argument for another type or a reach that is not > 8
std::optional<TipMeasurement> measure_tip(std::span<const cv::Mat> images, const Eigen::Vector2d& expected_px,
                                          double reach_px);

/// Interpolates between the centres of a grey image's pixels. Returns nothing outside them.
template <typename Pixel>
std::optional<double> bilinear(const cv::Mat& grey, const Eigen::Vector2d& p) {
  if (!(p.x() >= 0 && p.y() >= 0 && p.x() < grey.cols - 1 && p.y() < grey.rows - 1)) return std::nullopt;
  const int column = static_cast<int>(p.x());
  const int row = static_cast<int>(p.y());
  const double fx = p.x() - column;
  const double fy = p.y() - row;
  const auto at = [&grey](int r, int c) { return double(grey.at<Pixel>(r, c)); };
  return (1 - fy) * ((1 - fx) * at(row, column) + fx * at(row, column + 1)) +
         fy * ((1 - fx) * at(row + 1, column) + fx * at(row + 1, column + 1));
}

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace twocone::vision {

/// The rim of a mirror as a circle in the picture.
struct RimCircle {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 0;
  double support = 0;  ///< share of the directions from the centre whose edge lies within a pixel of the circle, 0 to 1
};

/// Looks for the rim within a fifth of `expected`'s radius about it: along each of 360 directions the strongest step of
/// brightness, then the circle that fits most of those edges (least squares, edges weighted down as they lie off it).
/// Where nothing agrees with more than a third of the directions (an even background, a picture without mirror):
/// nothing.
///
/// Edges at which the picture gets dark and stays so to the end of the search count only where the others make no
/// circle: a picture may hold the mirror and its nearest surroundings only, and where it ends is no rim; but a rim may
/// stand before something dark.
///
/// Sub-pixel where the step is sharp, but only as good as the contrast between rim and background: a check, not a
/// calibration.
/// @param rgb CV_8UC3. @throws std::invalid_argument for another type or an `expected.radius_px` that is not > 0
std::optional<RimCircle> find_rim(const cv::Mat& rgb, const RimCircle& expected);

/// Whether brightness changes clearly, by 12 grey levels, in a third of the directions where find_rim() looks, but for
/// where the picture gets dark for good. If not, a rim that is not found tells nothing: it may be there and not stand
/// out from what is behind it.
/// @throws as find_rim()
bool rim_may_show(const cv::Mat& rgb, const RimCircle& expected);

}  // namespace twocone::vision

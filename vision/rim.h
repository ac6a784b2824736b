// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace twocone::vision {

/// The rim of a mirror as a circle in the image.
struct RimCircle {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 0;
  double support = 0;  ///< share of the directions from the centre whose edge lies within a pixel of the circle, 0 to 1
};

/// Searches for the rim within a fifth of `expected`'s radius about it: finds the strongest step of brightness along
/// each of 360 directions, then the circle that fits most of those edges (least squares, with less weight the farther
/// an edge is from the circle). Nothing where no circle agrees with more than a third of the directions (an even
/// background, an image without mirror).
///
/// Edges at which the image gets dark and stays dark to the end of the search count only where the others make no
/// circle. An image may hold only the mirror and its nearest surroundings, and the end of these is not the rim; but a
/// rim may also have a dark background.
///
/// The accuracy is sub-pixel where the step is sharp, but it depends on the contrast between rim and background: this
/// is a check, not a calibration.
/// @param rgb CV_8UC3. @throws std::invalid_argument for another type or an `expected.radius_px` that is not > 0
std::optional<RimCircle> find_rim(const cv::Mat& rgb, const RimCircle& expected);

/// Returns whether brightness changes clearly, by 12 grey levels, in a third of the directions in which find_rim()
/// searches, not counting edges where the image gets dark to the end of the search. If not, a rim that is not found
/// means nothing: it may be there without contrast to its background.
/// @throws as find_rim()
bool rim_may_show(const cv::Mat& rgb, const RimCircle& expected);

}  // namespace twocone::vision

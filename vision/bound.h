// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "base/plane.h"
#include "vision/mirror_view.h"

namespace twocone::vision {

/// Computes the Cramer-Rao bound of a sighting, as information. No unbiased estimator that knows the landmark's shape
/// has a smaller covariance.
///
/// The outline (two sides, curved rim of the top) is a curve in the image. A displacement field u(l) of the outline,
/// where l is the length along the curve and n its normal, carries the information
///
///     integral of (n . du/dp)(n . du/dp)^T dl / sigma^2,
///
/// where sigma = `edge_noise_px` is the standard deviation of the outline's position for each pixel of its length.
/// Where each pixel is the mean over its area, sigma is pixel noise over contrast. Such a pixel is a box filter of one
/// pixel. It keeps all information of an edge along the rows or columns, and at least 93 % of that of a slanted edge.
/// For images, the bound is too low by that much.
/// Parameters p: the landmark's range (m) and bearing (rad) from the body's origin; its radius and top are known.
///
/// The outline:
/// * A side is where rays graze the cylinder. It runs from the top down to the horizon (image radius 0: upright 90
///   degree views show nothing below their virtual viewpoint) or to the floor, whichever comes first.
/// * The rim of the top runs between the two sides, on the near side for a view that looks up at it and on the far side
///   for a view that looks down.
/// * The foot adds nothing, even where a view shows it, because objects in front of it are not known.
/// Parts outside the mirror's rim add nothing.
///
/// u comes from MirrorView's analytic derivative. At a grazing ray, a shift of the point of contact round the cylinder
/// moves the image point along the curve only, so n . du needs no derivative of the point of contact. The integrals use
/// Gauss's rule with 8 points for each side and for each half of the top. For upright 90 degree views the rule is exact
/// on the sides, and the whole is accurate to 1e-6 of the information; for tilted views behind a lens it is tested to
/// 5e-3 (bound_test.cpp). Where the mirror's rim cuts through the outline, it is accurate to a few per cent only.
///
/// @param p_BL_m position of the landmark's axis, body frame
/// @returns information on (range, bearing); the information of both views is the sum. It is empty where the view
/// does not show the near point, or where the body's origin lies on the landmark's axis.
/// @throws std::invalid_argument for edge_noise_px or radius not > 0 (zero noise is refused), or a top not finite
std::optional<Eigen::Matrix2d> sighting_information(const MirrorView& view, const Landmark& target,
                                                    const Eigen::Vector2d& p_BL_m, double edge_noise_px);

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "vision/mirror_view.h"
#include "vision/ranging.h"

namespace twocone::vision {

/// The Cramer-Rao bound of a sighting: no unbiased estimator that knows the landmark's shape has a smaller covariance.
///
/// The outline (two sides, curved rim of the top) is a curve in the picture. A displacement field u(l) of it, l the
/// length along the curve and n its normal, carries the information
///
///     integral of (n . du/dp)(n . du/dp)^T dl / sigma^2,
///
/// where sigma = `edge_noise_px` is the standard deviation of the outline's place for each pixel of its length: pixel
/// noise over contrast for a picture that a pixel's area makes (a box of one pixel, which keeps all of an edge along
/// the rows or columns and at least 93 % of a slanted one, so that the bound is that much too low for pictures).
/// Parameters p: the landmark's range (m) and bearing (rad) from the body's origin, its radius and top known.
///
/// The outline:
/// * a side is where rays graze the cylinder, from the top down to the horizon (image radius 0: upright 90 degree views
/// show
///   nothing below their virtual viewpoint) or to the floor, whichever comes first;
/// * the top's rim between the two sides, on the near side for a view that looks up at it and on the far side for one
/// that
///   looks down;
/// * the foot, where a view shows it, does not count: what stands before it is not known.
/// What of it lies outside the mirror's rim adds nothing.
///
/// u is by MirrorView's analytic derivative: at a grazing ray the point's slip round the cylinder moves it along the
/// curve only, so n . du needs no derivative of the point of contact. The integrals are by Gauss's rule with 8 points
/// for each side and for each half of the top: for upright 90 degree views exact on the sides, and in all good to 1e-6
/// of the information; for tilted ones behind a lens it is tested to 5e-3 (bound_test.cpp). Good to a few per cent only
/// where the mirror's rim cuts through the outline.
///
/// @param p_BL_m of the landmark's axis, body frame
/// @returns information of (range, bearing); of both views it is the sum. Nothing where the view does not show the near
/// point, or where the body's origin lies on the landmark's axis. Zero noise is refused:
/// @throws std::invalid_argument for edge_noise_px or radius not > 0, and for a target without a top
std::optional<Eigen::Matrix2d> sighting_information(const MirrorView& view, const Target& target,
                                                    const Eigen::Vector2d& p_BL_m, double edge_noise_px);

}  // namespace twocone::vision

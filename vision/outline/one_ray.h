// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "vision/outline/outline_fit.h"

/// The place of a landmark in an image whose pixels are one ray each.
///
/// Such a pixel shows the landmark or the background, and no mixture of the two. It does not measure the distance of
/// the outline; it states on which side of the outline its centre lies. The stairs along an edge are no noise: where an
/// edge runs nearly along the rows, the errors of a fit to coverages are the same for many pixels, and elsewhere they
/// cancel. Therefore the posterior of the place is computed from the statements themselves. Without errors it is
/// uniform over the places that agree with every pixel, and these are a polygon of the size of 1 / length of the
/// outline, in pixels.
///
/// The projected outline is not exact (rig, map, curvature). A pixel whose centre lies a distance d inside it shows the
/// landmark with probability
///
///     p(d) = 1/2 + d / (2 tolerance), limited to kOneRayMiss and 1 - kOneRayMiss.
///
/// The tolerance is not known beforehand. The posterior is computed for each of kTolerances_px, and so is the evidence,
/// the probability of all pixels under that tolerance. The tolerance of a view is the one with most evidence.
namespace twocone::vision {

/// Probability that a pixel contradicts the outline for another reason than the tolerance, on either side. A smaller
/// value believes an outline that something hides for longer. Tuned by hand on rendered images; no test fixes it.
constexpr double kOneRayMiss = 1e-3;

/// The tolerances, in steps of four. The greatest is that of a pixel's own width (1 / sqrt(12) px as a standard
/// deviation is 0.5 px as a half width); the least is below the error of the projected outline.
constexpr std::array<double, 5> kTolerances_px{0.3, 0.1, 0.03, 0.01, 0.003};

/// The posterior of the place under one tolerance.
struct OneRayFit {
  /// From the cylinder from which the outline was projected, (range m, bearing rad): mean and covariance.
  Eigen::Vector2d step = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  double log_evidence = 0;  ///< up to a constant that all tolerances share
};

/// The posteriors under each of kTolerances_px.
struct OneRayFits {
  std::array<OneRayFit, kTolerances_px.size()> by_tolerance;
  /// Sum over the used outline of the squared motion of its normal with the place, (range m, bearing rad), for each
  /// pixel of its length.
  Eigen::Matrix2d motion = Eigen::Matrix2d::Zero();
};

/// Computes the posteriors. Returns nothing where even the greatest tolerance has none near the fit.
/// @param edge_samples,fit what fit_outline() fitted, and its answer
std::optional<OneRayFits> fit_one_ray(const EdgeSamples& edge_samples, const OutlineFit& fit);

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "vision/outline/edge_samples.h"
#include "vision/outline/outline.h"

namespace twocone::vision {

/// The scatter of pixels about the model.
struct PixelNoise {
  double code_variance = 1;  ///< grey levels squared
  /// The variance of a pixel's coverage c is this share of c (1 - c): 1 where each pixel is a single ray, 0 where it is
  /// the mean over its area. The default serves coarse fits; it is tuned by hand on synthetic images, and no test fixes
  /// it.
  double sampling = 0.1;
};

/// The limits of a fit. All calls in this library set all three values, so the defaults are not used.
struct FitLimits {
  /// The interval of the edges' width, which starts at the lower end; 1 where a pixel is the mean over its own area.
  double least_blur_px = 1;
  double most_blur_px = 8;
  double converged_px = 1e-7;  ///< the fit stops at a step below this
};

/// Sums of the edge samples' scores (the slopes of the likelihood), squared and with the products of neighbours. They
/// measure the real scatter of the data, whatever its reason.
struct Scores {
  double found = 0;
  double expected = 0;  ///< for the given PixelNoise and no correlation; also the information of the samples, in 1/px^2
};

/// What a fit shows of the image's noise and blur.
struct EdgeStatistics {
  double code_variance = 0;  ///< EdgeSamples::code_variance
  double residual = 0;       ///< sum over edge pixels of squared coverage residuals
  double grey = 0;           ///< sum over edge pixels of the coverage variance caused by a noise of one grey level
  double spread = 0;         ///< sum over edge pixels of c (1 - c)
  double blur = 1;           ///< width of the edges, in pixels
};

/// The most likely place of one cylinder in one view.
struct OutlineFit {
  Cylinder cylinder;
  Outline outline;              ///< of the cylinder from which the fit started
  Eigen::Vector2d step;         ///< from that cylinder to `cylinder`, (range m, bearing rad)
  Eigen::Matrix2d information;  ///< of (range m, bearing rad) for the given PixelNoise
  double length_px = 0;         ///< length of the outline that was used
  double arc_support = 0;       ///< share of the arc, and of each side, that can be used
  double left_support = 0, right_support = 0;
  double narrowness_px = 0;  ///< width of the cylinder's outline minus the observed width
  double sigma_narrowness_px = 0;
  // These are pooled over the landmarks of an image:
  Scores arc_scores, side_scores;
  EdgeStatistics edges;
};

/// Least squares of the pixels' coverage over range, bearing and blur. Nothing where too little of the outline is
/// usable.
/// @param outline the outline of `cylinder`, from which the edge samples were read
std::optional<OutlineFit> fit_outline(const EdgeSamples& edge_samples, const Cylinder& cylinder, const Outline& outline,
                                      const PixelNoise& noise, const FitLimits& limits);

}  // namespace twocone::vision

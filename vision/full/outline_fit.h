// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "vision/full/outline.h"
#include "vision/full/stations.h"

namespace twocone::vision {

/// How pixels scatter about the model.
struct PixelNoise {
  double code_variance = 1;  ///< grey levels squared
  /// Share of c (1 - c) that the coverage c of a pixel scatters by: 1 where each pixel is a single ray, 0 where it is
  /// the mean over its area.
  double sampling = 0.1;
};

/// How a fit goes about it.
struct FitLimits {
  /// Where the width of the edges is looked for, from its lower end; 1 where a pixel is the mean over its own area.
  double least_blur_px = 1;
  double most_blur_px = 8;
  double converged_px = 1e-7;  ///< a step below which it stops
};

/// The stations' scores (the slopes of the likelihood), squared and with the products of neighbours: how much the data
/// really scatter, whatever the reason.
struct Scores {
  double found = 0;
  double expected = 0;  ///< for PixelNoise as given and no correlation; also the information that they hold, in 1/px^2
};

/// The most likely place of one cylinder in one view.
struct OutlineFit {
  Cylinder cylinder;
  Outline outline;              ///< of the cylinder that the fit began from
  Eigen::Vector2d step;         ///< from there to `cylinder`, (range m, bearing rad)
  Eigen::Matrix2d information;  ///< of (range m, bearing rad) for PixelNoise as given
  double blur = 1;              ///< width of the edges, in pixels
  double length_px = 0;         ///< of the outline that was used
  double arc_support = 0;       ///< share of the arc, and of each side, that can be used
  double left_support = 0, right_support = 0;
  double narrowness_px = 0;  ///< how much nearer to each other the sides are seen than the cylinder has them
  double sigma_narrowness_px = 0;
  // For pooling over the landmarks of a picture:
  Scores arc_scores, side_scores;
  double code_variance = 0;  ///< Stations::code_variance
  double residual = 0;       ///< of edge pixels, sums of: squared coverage residuals,
  double grey = 0;           ///< the variance of coverage that a noise of one grey level makes,
  double spread = 0;         ///< c (1 - c)
};

/// Least squares of the pixels' coverage over range, bearing and blur. Nothing where too little of the outline is
/// usable.
/// @param outline that of `cylinder`, whose stations these are
std::optional<OutlineFit> fit_outline(const Stations& stations, const Cylinder& cylinder, const Outline& outline,
                                      const PixelNoise& noise, const FitLimits& limits);

}  // namespace twocone::vision

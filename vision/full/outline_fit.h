// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vision/full/colour_table.h"
#include "vision/full/outline.h"

namespace twocone::vision {

/// One pixel on the outline: how much of it the landmark covers, as its colour tells, and what the model makes of it.
struct EdgePixel {
  float inside_px;  ///< signed distance of its centre to the outline, inside positive
  float coverage;   ///< measured: 0 background, 1 landmark; noise takes it beyond
  float variance;   ///< of `coverage` for a noise of one grey level
};

/// The outline where it crosses one row or column of pixels.
struct Station {
  enum Part : std::int8_t { kLeft, kArc, kRight };
  Part part;
  bool is_usable;           ///< the landmark's colour inside, another one outside, enough contrast, within the picture
  float wide, narrow;       ///< larger and smaller of the normal's |x| and |y|
  float by_range_pxpm;      ///< outward motion of the outline with the landmark's range ...
  float by_bearing_pxprad;  ///< ... and bearing
  float width_px;           ///< to the opposite side
  float doubt;              ///< variance of coverage because the background beside it is not what it was taken for
  int first, count;         ///< of its pixels
};

/// The outline's stations in order along it, with their pixels.
struct Stations {
  std::vector<Station> stations;
  std::vector<EdgePixel> pixels;
  int too_bright = 0;        ///< stations whose contrast is lost in channels at full scale
  double code_variance = 0;  ///< of pixels beside the outline about their neighbours, grey levels squared, median
  void clear();
};

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

struct Reach {
  /// How far inside and outside the colours of landmark and background are taken, beyond what the outline may be off.
  double colours_px = 0;
  double blur_px = 1;  ///< what the edges' width is taken to be
};

/// Reads the pixels along an outline.
/// @param label of the landmark in `table`
/// @param stride of the rows and columns that are read: 1 for all
void read_stations(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label, const Outline& outline,
                   const Reach& reach, int stride, Stations& stations);

/// Least squares of the pixels' coverage over range, bearing and blur. Nothing where too little of the outline is
/// usable.
/// @param outline that of `cylinder`, whose stations these are
std::optional<OutlineFit> fit_outline(const Stations& stations, const Cylinder& cylinder, const Outline& outline,
                                      const PixelNoise& noise, const FitLimits& limits);

}  // namespace twocone::vision

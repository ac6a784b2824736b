// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "vision/hue_labels.h"
#include "vision/outline/outline.h"

namespace twocone::vision {

/// The share of a pixel inside a straight edge, and its derivative by the edge's distance. It is exact for a square
/// pixel where `wide` and `narrow` are the larger and the smaller of |x| and |y| of the edge's normal, times the
/// pixel's width.
struct Coverage {
  double value, slope;
};
inline Coverage coverage(double inside_px, double wide, double narrow) {
  const double half = (wide + narrow) / 2;
  const double distance = std::abs(inside_px);
  if (distance >= half) return {inside_px > 0 ? 1.0 : 0.0, 0.0};
  if (distance <= (wide - narrow) / 2) return {0.5 + inside_px / wide, 1 / wide};
  const double corner = half - distance;
  const double area = corner * corner / (2 * wide * narrow);
  return {inside_px > 0 ? 1 - area : area, corner / (wide * narrow)};
}

/// One pixel on the outline: its place relative to the outline, and the landmark's coverage measured by its colour.
struct EdgePixel {
  float inside_px;  ///< signed distance of its centre to the outline, inside positive
  float coverage;   ///< measured: 0 background, 1 landmark; noise may take it beyond either
  float variance;   ///< of `coverage` for a noise of one grey level
};

/// A place along the outline where it crosses one row or column of pixels.
struct EdgeSample {
  enum Part : std::int8_t { kLeft, kArc, kRight };
  Part part;
  bool is_usable;           ///< the landmark's colour inside, another one outside, enough contrast, within the image
  float wide, narrow;       ///< larger and smaller of the normal's |x| and |y|
  float by_range_pxpm;      ///< outward motion of the outline with the landmark's range ...
  float by_bearing_pxprad;  ///< ... and bearing
  float width_px;           ///< distance to the opposite side
  float inside_noise, outside_noise;  ///< variance of the landmark's and the background's colour, over that of a pixel
  float doubt;       ///< variance of coverage because the background beside it differs from the one assumed
  int first, count;  ///< index of its first pixel, and their number
};

/// The outline's edge samples in order along it, with their pixels.
struct EdgeSamples {
  std::vector<EdgeSample> edge_samples;
  std::vector<EdgePixel> pixels;
  int too_bright = 0;        ///< number of edge samples whose contrast is lost in channels at full scale
  double code_variance = 0;  ///< of pixels beside the outline about their neighbours, grey levels squared, median
  void clear();
};

/// The pixels that are read on either side of an outline.
struct SampleReach {
  /// Distance inside and outside at which the colours of landmark and background are read. It is larger than the error
  /// of the outline.
  double colours_px = 0;
  double blur_px = 1;  ///< assumed width of the edges
  /// A colour is the mean of this number of pixels of a row or column, where as many show it alone. Few pixels are more
  /// accurate where light and background change along the row, many where pixels are noisy. Tuned by hand on synthetic
  /// images; no test fixes it.
  int samples = 3;
};

/// Reads the pixels along an outline.
/// @param label the landmark's label in `table`
/// @param stride distance of the rows and columns that are read: 1 for all
void read_edge_samples(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label, const Outline& outline,
                       const SampleReach& reach, int stride, EdgeSamples& edge_samples);

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "vision/outline/colour_table.h"
#include "vision/outline/outline.h"

namespace twocone::vision {

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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

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
  float inside_noise, outside_noise;  ///< variance of the landmark's and the background's colour, over that of a pixel
  float doubt;       ///< variance of coverage because the background beside it is not what it was taken for
  int first, count;  ///< of its pixels
};

/// The outline's stations in order along it, with their pixels.
struct Stations {
  std::vector<Station> stations;
  std::vector<EdgePixel> pixels;
  int too_bright = 0;        ///< stations whose contrast is lost in channels at full scale
  double code_variance = 0;  ///< of pixels beside the outline about their neighbours, grey levels squared, median
  void clear();
};

/// What is read on either side of an outline.
struct Reach {
  /// How far inside and outside the colours of landmark and background are taken, beyond what the outline may be off.
  double colours_px = 0;
  double blur_px = 1;  ///< what the edges' width is taken to be
  /// A colour is the mean of so many pixels of a row or column, where so many show it alone. Few are truer where light
  /// and background change along it, many where pixels are noisy.
  int samples = 3;
};

/// Reads the pixels along an outline.
/// @param label of the landmark in `table`
/// @param stride of the rows and columns that are read: 1 for all
void read_stations(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label, const Outline& outline,
                   const Reach& reach, int stride, Stations& stations);

}  // namespace twocone::vision

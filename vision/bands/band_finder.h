// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "vision/mirror_view.h"
#include "vision/outline/finder.h"

namespace twocone::vision {

/// The bands of one landmark in one view.
struct BandCandidate {
  int number = 0;             ///< vision/bands/band_code.h
  Candidate candidate;        ///< `top_px`: radius of the line that the print marks; `area_px`: number of kDirections
  double slope_per_cell = 0;  ///< by how much the slope of the ray falls from one cell to the next, > 0
  double line_slope = 0;      ///< of the ray to the line
  double bearing_rad = 0;     ///< unit's frame (vision/mirror_view.h)
  double sigma = 0;           ///< of `slope_per_cell`, relative
  float limit = 0;            ///< linear grey between that of dark cells and that of light ones
};

/// Reads banded landmarks in the mirror's image.
///
/// All points above each other are seen from one point, so that equal cells of an upright cylinder take equal steps of
/// the slope of the ray (height by distance), whatever the cone. The image's grey is resampled along kDirections lines
/// from the tip, in equal steps of slope. On each line, each pair of edges of which the upper one turns from dark to
/// light on the way down, and the lower one from light to dark, may be the first and the last edge of a code. Then all
/// cells are read; what is no code, or unlike the image of its cells, is dropped. Neighbouring lines that read the same
/// are one landmark. A tilted mirror sees upright things as upright here, which a tilt of some degrees allows.
class BandFinder {
 public:
  static constexpr int kDirections = 720;

  BandFinder(const MirrorView& view, cv::Size size);

  /// Returns what the image shows, the widest of each number first. @param rgb CV_8UC3 of the constructor's size
  [[nodiscard]] std::vector<BandCandidate> find(const cv::Mat& rgb) const;

  /// Returns the covariance of where a candidate is, px^2, that comes from the distance of the lines beside each other.
  static Eigen::Matrix2d between_lines_px2(const Candidate& candidate);

  /// The place of bands by their own size.
  struct Place {
    double distance_m;  ///< from the view's axis to the surface
    double line_m;      ///< height of the line over the floor
  };
  [[nodiscard]] Place place_of(const BandCandidate& bands, double cell_m) const;

 private:
  /// A number that one line from the tip shows.
  struct Reading {
    int direction, number;
    double first, last;  ///< steps of its first (upper) and last edge
    double limit;        ///< grey level between light and dark
    double likeness;     ///< correlation of the line with the image of its cells
  };
  /// @param profile grey levels of one line, outwards from the tip
  void read(std::span<const std::uint8_t> profile, int direction, std::vector<Reading>& readings) const;
  [[nodiscard]] std::optional<BandCandidate> candidate_of(const std::vector<Reading>& readings) const;
  /// Returns the pixel that shows a step of a line, nothing where the lens shows none.
  [[nodiscard]] std::optional<Eigen::Vector2d> pixel_of(double direction, double step) const;
  [[nodiscard]] double slope_of(double step) const { return least_slope_ + step * slope_step_; }

  MirrorView view_;
  double sin_apex_, cos_apex_;
  int steps_ = 0;
  double least_slope_ = 0, slope_step_ = 0;
  cv::Mat columns_, rows_;  ///< of the pixel of each direction (row) and step (column): CV_32F
};

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "vision/hue_labels.h"
#include "vision/mirror_view.h"

namespace twocone::vision {

/// A region of a landmark's colour in one view, located to a pixel or two: the start of a fit.
struct Candidate {
  double angle_rad = 0;             ///< of its middle, in the image: atan2(row, column) about the tip
  double top_px = 0;                ///< radius at which it ends
  double area_px = 0;               ///< number of pixels of its colour
  bool at_rim = false;              ///< its colour reaches the rim
  int first_bin = 0, last_bin = 0;  ///< of Found::area_px; `last_bin` may pass its end
};

/// All regions of one landmark's colour in a view.
struct Found {
  std::vector<Candidate> candidates;  ///< largest first
  /// Number of pixels of the colour by direction, in Finder::kBins equal parts of the circle, counted from the image's
  /// x axis. Pixels nearer to the tip than Finder::kSureRadius_px are left out. Empty without candidates.
  std::vector<double> area_px;
};

/// Searches the mirror's image for each landmark's colour. A landmark is a wedge that points at the tip, so its pixels
/// are counted by direction; runs of directions are candidates.
class Finder {
 public:
  Finder(const MirrorView& view, cv::Size size);

  /// Returns the regions of each wanted colour. @param rgb CV_8UC3 of the constructor's size
  [[nodiscard]] std::vector<Found> find(const cv::Mat& rgb, const ColourTable& table,
                                        const std::vector<bool>& wanted) const;

  /// Smaller regions are not reported. Tuned by hand on synthetic images; no test fixes it.
  static constexpr double kLeastArea_px = 12;
  /// Bins of half a degree. Tuned by hand on synthetic images; no test fixes it.
  static constexpr int kBins = 720;
  /// Beyond this radius, the direction of a pixel that a landmark covers by half differs from the landmark's by at most
  /// 2.5 degrees: half the pixel's diagonal over the radius.
  static constexpr double kSureRadius_px = 16;

 private:
  struct Span {
    int begin, end;  ///< columns
  };
  /// A pixel of a landmark's colour.
  struct Polar {
    float angle_deg, radius_px;
  };
  void gather(const cv::Mat& rgb, const ColourTable& table, int stride,
              std::vector<std::vector<Polar>>& by_colour) const;
  [[nodiscard]] Found found_of(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label,
                               const std::vector<Polar>& hits, int stride) const;
  [[nodiscard]] std::optional<Candidate> candidate_of(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label,
                                                      const std::vector<Polar>& wedge, int stride) const;
  /// Returns the top to a pixel, found by counting pixels across the wedge near `top_px`.
  [[nodiscard]] double refined_top(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label, double angle_rad,
                                   double half_rad, double top_px) const;

  Eigen::Vector2d centre_px_;
  double rim_px_;
  int first_row_ = 0;
  std::vector<Span> spans_;  ///< the mirror's columns in each row, from first_row_ on
};

}  // namespace twocone::vision

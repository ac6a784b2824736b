// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "vision/full/colour_table.h"
#include "vision/mirror_view.h"

namespace twocone::vision {

/// Something of a landmark's colour in one view, to a pixel or two: where to begin.
struct Candidate {
  double angle_rad = 0;             ///< of its middle, in the picture: atan2(row, column) about the tip
  double top_px = 0;                ///< radius at which it ends
  double area_px = 0;               ///< pixels of its colour
  bool at_rim = false;              ///< its colour reaches the rim
  int first_bin = 0, last_bin = 0;  ///< of Found::area_px; `last_bin` may pass its end
};

/// All that a view shows of one landmark's colour.
struct Found {
  std::vector<Candidate> candidates;  ///< largest first
  /// Pixels of the colour by direction, in Finder::kBins equal parts of the circle from the picture's x axis on; those
  /// nearer to the tip than Finder::kSureRadius_px are left out. Empty without candidates.
  std::vector<double> area_px;
};

/// Looks through the mirror's picture for each landmark's colour. A landmark is a wedge that points at the tip, so its
/// pixels are counted by direction; runs of directions are candidates.
class Finder {
 public:
  Finder(const MirrorView& view, cv::Size size);

  /// For each colour, what there is of it if it is wanted. @param rgb CV_8UC3 of the size given
  [[nodiscard]] std::vector<Found> find(const cv::Mat& rgb, const ColourTable& table,
                                        const std::vector<bool>& wanted) const;

  /// Smaller things are not reported.
  static constexpr double kLeastArea_px = 12;
  static constexpr int kBins = 720;
  /// From here on the direction of a pixel that a landmark covers half lies within 2.5 degrees of the landmark's: half
  /// its diagonal over the radius.
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
  /// The top to a pixel, by counting across the wedge about `top_px`.
  [[nodiscard]] double refined_top(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label, double angle_rad,
                                   double half_rad, double top_px) const;

  Eigen::Vector2d centre_px_;
  double rim_px_;
  int first_row_ = 0;
  std::vector<Span> spans_;  ///< of the mirror, from first_row_ on
};

}  // namespace twocone::vision

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
  double angle_rad = 0;  ///< of its middle, in the picture: atan2(row, column) about the tip
  double top_px = 0;     ///< radius at which it ends
  double area_px = 0;    ///< pixels of its colour
  bool at_rim = false;   ///< its colour reaches the rim
};

/// Looks through the mirror's picture for each landmark's colour. A landmark is a wedge that points at the tip, so its
/// pixels are counted by direction; runs of directions are candidates.
class Finder {
 public:
  Finder(const MirrorView& view, cv::Size size);

  /// Candidates of each colour that is wanted, largest first. @param rgb CV_8UC3 of the size given
  [[nodiscard]] std::vector<std::vector<Candidate>> find(const cv::Mat& rgb, const ColourTable& table,
                                                         const std::vector<bool>& wanted) const;

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
  [[nodiscard]] std::vector<Candidate> candidates_of(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label,
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

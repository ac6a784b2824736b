// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vision/hue_labels.h"
#include "vision/mirror_view.h"
#include "vision/ranging.h"
#include "vision/rings.h"

namespace twocone::vision {

/// Method `paper`: range finding as in section 3.2 of Burbridge & Spacek 2006, in whole pixels, kept as the baseline.
///
///     range = v s / disparity - d (equation 1),   v = (d / R + 1) r_m (equation 2)
///
/// 1. In the lower image test the pixels of a circle round the tip, first the rim's, then ever smaller ones. The first
///    circle with a pixel of the landmark's colour gives the lower match.
/// 2. In the upper image go along the line of pixels from the lower match's place to the centre. The first pixel of
/// that
///    colour is the upper match.
/// 3. The distance between the two is the disparity.
///
/// Equation 1 gives the near edge of the landmark's top; `range_m` is that plus the landmark's radius: our one
/// addition.
///
/// Settled where the paper leaves it open:
/// * "above the colour threshold": HueLabels, whose constants say how.
/// * A circle of radius k holds the pixels whose distance from the centre rounds to k, so that no pixel lies between
/// circles.
/// * A circle that holds several such pixels: the middle one of the first run, counted from the image's x axis.
/// * The outermost circle whose pixels lie wholly in the mirror is tested first; a match on it is `truncated`, since
/// the top may
///   lie outside. (The paper writes 0 for a pillar that is too close.)
/// * The two images' centres, azimuths and focal lengths may differ: the lower match is carried over by its bearing and
/// its
///   radius over v, and the upper match is brought back likewise before the distance is taken. Where they are equal, as
///   in the paper, that changes nothing.
/// * No sigma is stated, as the paper states none.
///
/// Domain: both cones have an apex of 90 degrees and one R and d, no tilt, no offset and no lens distortion. Error
/// growth: sigma_range = (range + d)^2 sigma_disparity / (v s).
class PaperRanging {
 public:
  /// @param wanted those of the targets that are looked for; empty: all. The others' verdict is kNotSeen.
  /// @throws std::invalid_argument for a rig outside the domain, std::out_of_range for a wanted one that is no target
  PaperRanging(const Rig& rig, const std::vector<Target>& targets, cv::Size lower_size, cv::Size upper_size,
               const std::vector<std::size_t>& wanted = {});

  /// One measurement for each target, in their order.
  /// @param lower,upper CV_8UC3, r g b, sRGB-coded. @throws std::invalid_argument for another type or size
  [[nodiscard]] std::vector<RangeMeasurement> measure(const cv::Mat& lower, const cv::Mat& upper) const;

 private:
  struct Match {
    cv::Point pixel;
    int ring;
  };
  [[nodiscard]] RangeMeasurement measure_one(std::size_t target, const cv::Mat& lower_labels,
                                             const cv::Mat& upper_labels) const;
  [[nodiscard]] std::optional<Match> find_outermost(const cv::Mat& labels, int label) const;
  [[nodiscard]] std::optional<cv::Point> find_on_line(const cv::Mat& labels, int label,
                                                      const Eigen::Vector2d& from) const;

  Rig rig_;
  std::vector<Target> targets_;
  std::vector<bool> wanted_;
  HueLabels hues_;
  Rings lower_rings_;
  cv::Size lower_size_;
  cv::Size upper_size_;
};

}  // namespace twocone::vision

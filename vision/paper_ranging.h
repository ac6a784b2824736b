// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vision/hue_labels.h"
#include "vision/mirror_view.h"
#include "vision/ranging.h"

namespace twocone::vision {

/// Method `paper`: range finding as in section 3.2 of Burbridge & Spacek 2006, in whole pixels, kept as the baseline.
///
///     range = v s / disparity - d (equation 1),   v = (d / R + 1) r_m (equation 2)
///
/// 1. In the lower image, test the pixels of circles round the tip, first the rim's circle, then ever smaller ones. The
///    first circle with a pixel of the landmark's colour gives the lower match.
/// 2. In the upper image, follow the line of pixels from the position of the lower match to the centre. The first pixel
///    of that colour is the upper match.
/// 3. The distance between the two is the disparity.
///
/// Equation 1 gives the near edge of the landmark's top; `range_m` is that plus the landmark's radius. This is our only
/// addition to the paper.
///
/// Decisions where the paper leaves a choice:
/// * "Above the colour threshold" is the test of HueLabels, with its constants.
/// * A circle of radius k holds the pixels whose distance from the centre rounds to k, so none lies between circles.
/// * Where a circle holds several pixels of the colour, the match is the middle one of the first run, counted from the
///   image's x axis.
/// * The outermost circle whose pixels lie wholly in the mirror is tested first. A match on it is `truncated`, since
///   the top may lie outside. (The paper writes 0 for a landmark that is too close.)
/// * The two images' centres, azimuths and focal lengths may differ. The lower match is transferred by its bearing and
///   its radius over v, and the upper match is transferred back in the same way before the distance is measured. If the
///   images agree in all three, as in the paper, this changes nothing.
/// * No sigma is given, as the paper gives none.
///
/// Domain: both cones have an apex of 90 degrees and the same R and d, no tilt, no offset, no lens distortion; s > 0.
/// Error growth: sigma_range = (range + d)^2 sigma_disparity / (v s).
class PaperRanging {
 public:
  /// @param wanted indices of the targets to search for; empty: all. The verdict of the others is kNotSeen.
  /// @throws std::invalid_argument for a rig outside the domain, sizes that are not > 0, and targets without hue or
  /// radius; std::out_of_range for a wanted index that is not a target
  PaperRanging(const Rig& rig, const std::vector<Landmark>& targets, cv::Size lower_size, cv::Size upper_size,
               const std::vector<std::size_t>& wanted = {});

  /// Returns one measurement for each target, in their order.
  /// @param lower,upper CV_8UC3, r g b, sRGB-coded. @throws std::invalid_argument for another type or size
  [[nodiscard]] std::vector<RangeMeasurement> measure(const cv::Mat& lower, const cv::Mat& upper) const;

 private:
  [[nodiscard]] RangeMeasurement measure_one(std::size_t target, const cv::Mat& lower_labels,
                                             const cv::Mat& upper_labels) const;

  Rig rig_;
  std::vector<Landmark> targets_;
  std::vector<bool> wanted_;
  HueLabels hues_;
  /// The pixels of the lower image as circles round the tip: circle k holds the pixels whose distance from the tip
  /// rounds to k, ordered by their angle in [0, 2 pi) from the image's x axis towards its y axis. The last one is the
  /// largest whose pixels lie wholly inside the rim.
  std::vector<std::vector<cv::Point>> lower_rings_;
  cv::Size lower_size_;
  cv::Size upper_size_;
};

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/compare/comparison.h"

/// What of the pictures the page shows. Private to apps/compare/show.
namespace twocone::compare {

/// A pair's pictures of one view, CV_8UC3 b g r; empty where there is none.
struct ExhibitView {
  std::string view;         ///< lower, upper
  cv::Mat simulated, real;  ///< as they are, narrowed to what a page shows; of one size where both are there
  /// Unrolled on one scale of bearings, that of the real robot's heading: the simulated one is turned to it.
  cv::Mat simulated_strip, real_strip;
  /// real_strip - simulated_strip in brightness, coloured by difference_colour().
  cv::Mat difference;
  std::optional<double> mean_difference_grey;  ///< mean of its absolute values
  std::vector<std::string> notes;              ///< what is missing or was made fit, a sentence each
};

/// Brightness differences of so many grey levels and beyond have the strongest colour.
inline constexpr int kStrongestDifference_grey = 64;

/// b g r: real brighter is warm, darker cool, none nearly white. @param grey real - simulated
cv::Vec3b difference_colour(double grey);

/// Lower, then upper. Pictures that are not there or cannot be read, and rigs that cannot unroll them, are noted.
std::array<ExhibitView, 2> read_pictures(const Comparison& comparison, const Exhibit& exhibit);

}  // namespace twocone::compare

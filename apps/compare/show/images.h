// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/compare/comparison.h"

/// The images that the page shows. Private to apps/compare/show.
namespace twocone::compare {

/// A pair's images of one view, CV_8UC3 b g r; empty where there is none.
struct ExhibitView {
  vision::Side view = vision::Side::kLower;
  cv::Mat simulated, real;  ///< original images, reduced to the width of the page; of one size where both exist
  /// Unrolled on one scale of bearings, that of the real robot's heading; the simulated strip is turned to it.
  cv::Mat simulated_strip, real_strip;
  /// real_strip - simulated_strip in brightness, coloured by difference_colour().
  cv::Mat difference;
  std::optional<double> mean_difference_grey;  ///< mean of its absolute values
  std::vector<std::string> notes;              ///< what is missing or was resized, a sentence each

  [[nodiscard]] std::string name() const { return std::string(to_string(view)); }
};

/// Brightness differences of this many grey levels or more have the strongest colour.
inline constexpr int kStrongestDifference_grey = 64;

/// Returns b g r: warm where the real image is brighter, cool where it is darker, nearly white where both are equal.
/// @param grey real - simulated
cv::Vec3b difference_colour(double grey);

/// Returns lower, then upper. Images that are missing or unreadable, and rigs that cannot unroll them, are noted.
std::array<ExhibitView, 2> read_images(const Comparison& comparison, const Exhibit& exhibit);

}  // namespace twocone::compare

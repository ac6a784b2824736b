// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/compare/comparison.h"

/// Images of both runs side by side, for the page. Private to apps/compare.
namespace twocone::compare {

/// The images of one view of an exhibit, CV_8UC3 r g b; empty if missing.
struct ExhibitView {
  vision::Side view = vision::Side::kLower;
  cv::Mat simulated, real;  ///< original images, reduced to the width of the page; of one size if both exist
  /// Unrolled images on one axis of bearings, relative to the real robot's heading. The simulated strip is turned to
  /// it.
  cv::Mat simulated_strip, real_strip;
  /// real_strip - simulated_strip in brightness, coloured by difference_colour().
  cv::Mat difference;
  std::optional<double> mean_difference_grey;  ///< mean of its absolute values
  std::vector<std::string> notes;              ///< a sentence for each part that is missing or was resized

  [[nodiscard]] std::string name() const { return std::string(to_string(view)); }
};

/// Brightness differences of this many grey levels or more have the strongest colour.
inline constexpr int kStrongestDifference_grey = 64;

/// Returns a colour, r g b: warm if the real image is brighter, cool if it is darker, nearly white if both are equal.
/// @param grey real - simulated
cv::Vec3b difference_colour(double grey);

/// Returns the lower view, then the upper one. Notes state missing and unreadable images, and rigs that cannot unroll
/// them.
std::array<ExhibitView, 2> read_images(const Comparison& comparison, const Exhibit& exhibit);

}  // namespace twocone::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>

/// The results of Burbridge & Spacek 2006, in one place. Their rig and room differ from ours and are not given in full,
/// so these numbers stand beside ours for comparison. They are never values to reproduce.
namespace twocone::report::paper {

struct LandmarkFigures {
  std::string_view name;
  double max_mm;   ///< "Max. error/mm", table of section 4.1
  double mean_mm;  ///< "Average error/mm", the same table
  int figure;      ///< number of the graph of actual and computed distance
};

inline constexpr std::array<LandmarkFigures, 6> kLandmarks{{{"red", 136.6, 21.95, 11},
                                                            {"green", 124.8, 25.42, 12},
                                                            {"blue", 256.9, 51.97, 13},
                                                            {"cyan", 250.1, 62.93, 14},
                                                            {"magenta", 110.5, 23.17, 15},
                                                            {"yellow", 75.28, 20.14, 16}}};

inline constexpr double kPositionMean_mm = 29.97;  ///< section 4.2
inline constexpr double kPositionWithin_mm = 130;  ///< section 4.2: "to within 130 mm"
inline constexpr int kFigure17Frames = 180;        ///< the graph of position error ends there, of 450 frames

/// Returns the paper's numbers for the landmark called `name`, in upper or lower case; null for any other name.
inline const LandmarkFigures* find_landmark(std::string_view name) {
  std::string lower(name);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto* found = std::ranges::find(kLandmarks, lower, &LandmarkFigures::name);
  return found == kLandmarks.end() ? nullptr : found;
}

}  // namespace twocone::report::paper

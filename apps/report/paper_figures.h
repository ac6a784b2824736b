// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

/// What Burbridge & Spacek 2006 report, in one place. Their rig and room differ from ours and are not given in full,
/// so these stand beside our numbers as a yardstick, never as a value to reproduce.
namespace twocone::report::paper {

struct PillarFigures {
  std::string_view name;
  double max_mm;   ///< "Max. error/mm", table of section 4.1
  double mean_mm;  ///< "Average error/mm", the same
  int figure;      ///< graph of actual and computed distance
};

inline constexpr std::array<PillarFigures, 6> kPillars{{{"red", 136.6, 21.95, 11},
                                                        {"green", 124.8, 25.42, 12},
                                                        {"blue", 256.9, 51.97, 13},
                                                        {"cyan", 250.1, 62.93, 14},
                                                        {"magenta", 110.5, 23.17, 15},
                                                        {"yellow", 75.28, 20.14, 16}}};

inline constexpr double kPositionMean_mm = 29.97;  ///< section 4.2
inline constexpr double kPositionWithin_mm = 130;  ///< section 4.2: "to within 130 mm"
inline constexpr int kFigure17Frames = 180;        ///< its graph of position error ends there, of 450 frames

/// The paper's figures for a pillar of that name, upper or lower case; null for any other.
inline const PillarFigures* find_pillar(std::string_view name) {
  const auto same = [&](const PillarFigures& pillar) {
    return std::equal(name.begin(), name.end(), pillar.name.begin(), pillar.name.end(),
                      [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; });
  };
  const auto* found = std::find_if(kPillars.begin(), kPillars.end(), same);
  return found == kPillars.end() ? nullptr : found;
}

}  // namespace twocone::report::paper

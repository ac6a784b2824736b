// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

/// Pages to print: the bands of landmarks (vision/bands/band_code.h), to be wrapped round pipes.
namespace twocone::print_bands {

struct Paper {
  double width_mm = 210;  ///< A4, upright
  double height_mm = 297;
};

/// What no printer prints on, on each side.
constexpr double kMargin_mm = 12;

/// How many pages a landmark takes.
struct Sheets {
  int around = 1;  ///< side by side, round the pipe
  int above = 1;   ///< above each other, where the cells are high
};
/// @param radius_m of the pipe, > 0
/// @throws std::invalid_argument for cells that are not > 0 or higher than a page
Sheets sheets_of(const Paper& paper, double cell_m, double radius_m);

/// Returns an HTML file with all pages of these landmarks, at true size: dark cells printed, light ones left white, cut
/// marks, the number, an arrow to the top, the line whose height over the floor is line_m of the map, and a scale of
/// 100 mm to check the print with.
/// @throws std::invalid_argument as sheets_of, and for a number outside 1 to kBandNumbers
std::string pages(const std::vector<int>& numbers, const Paper& paper, double cell_m, double radius_m);

}  // namespace twocone::print_bands

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"

/// The results of Burbridge & Spacek 2006. Their rig and room differ from ours, and the paper does not describe them in
/// full. So these numbers stand beside ours for comparison only; they are not values to reproduce.
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
const LandmarkFigures* find_landmark(std::string_view name);

}  // namespace twocone::report::paper

/// Consequences of equation 1 of Burbridge & Spacek 2006 for a rig. All functions except is_right_angled and
/// rounding_error_m require 90 degree cones. R, d and v are those of the lower mirror; s is the mirrors' separation.
namespace twocone::report {

/// Returns whether both cones have an apex angle of 90 degrees.
bool is_right_angled(const config::Rig& rig);

/// Returns the change of range for one pixel of disparity at `range_m`, in metres: (range + d)^2 / (v s).
double range_per_pixel_m(const config::Rig& rig, double range_m);

/// Returns the nearest range at which both mirrors see a point, in metres: s (d + R) / R - d. From there on, the lower
/// mirror shows a point at the height of the upper tip inside its rim.
double nearest_common_m(const config::Rig& rig);

/// Returns the range, in metres, below which a top at `top_m` above the floor is outside the lower rim; 0 if it never
/// is.
double nearest_top_m(const config::Rig& rig, double top_m);

/// Returns the mean range error, in metres, that rounding both matches to whole pixels would cause alone, at the true
/// ranges to one landmark of this run. Two independent errors, each uniform within half a pixel, differ by a third of a
/// pixel on average. Returns nothing without ground truth, without ranges, or for cones of another angle.
std::optional<double> rounding_error_m(const runlog::RunData& run, const config::Landmark& landmark);

}  // namespace twocone::report

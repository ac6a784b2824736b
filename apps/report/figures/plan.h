// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/files/map_file.h"
#include "apps/report/report.h"

namespace twocone::report {

/// A world rectangle drawn with equal scales: world x to the right, y up, metres.
struct Sheet {
  files::Bounds world;
  int width_px = 0, height_px = 0;  ///< of the whole figure
  double left_px = 0, top_px = 0;   ///< of the plot in it
  double plot_width_px = 0, plot_height_px = 0;
};

/// Lays `world` out in a figure of at most `width_px` and `tallest_px`; an empty or infinite rectangle becomes a metre.
Sheet lay_out(files::Bounds world, int width_px, int tallest_px);

/// gnuplot commands: axes, margins and ranges of the sheet, with a scale bar. @param unit_m one POV-Ray unit
std::string sheet_commands(const Sheet& sheet, double unit_m);

/// gnuplot commands: walls and obstacles in grey.
std::string plan_commands(const files::Map& map);

/// gnuplot commands: the landmarks with their names. @param boxed the names on white, for use over a picture
std::string landmark_commands(const files::Map& map, bool boxed);

/// A landmark or point marked with a word.
std::string label_command(const std::string& text, double x_m, double y_m, const std::string& options);

/// A data block of the poses' places.
std::string pose_block(const std::string& name, const std::vector<runs::PoseRow>& poses);

/// The arena from above, CV_8UC3 b g r, covering the map's bounds. Kept as `cache` and read from there the next time.
/// Errors: kNotFound (no scene), those of sim_povray::render_overhead.
Result<cv::Mat> overhead_picture(const files::Map& map, const std::filesystem::path& cache,
                                 const sim_povray::RenderSettings& render);

}  // namespace twocone::report

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/config/map_file.h"
#include "apps/report/report.h"

namespace twocone::report {

/// A rectangle of the world, drawn with equal scales: world x to the right, y up, metres.
struct Sheet {
  config::Bounds world;
  int width_px = 0, height_px = 0;  ///< of the whole figure
  double left_px = 0, top_px = 0;   ///< of the plot within the figure
  double plot_width_px = 0, plot_height_px = 0;
};

/// Places `world` in a figure of at most `width_px` by `tallest_px`; an empty or infinite rectangle becomes 1 m by 1 m.
Sheet lay_out(config::Bounds world, int width_px, int tallest_px);

/// Returns gnuplot commands: axes, margins and ranges of the sheet, with a scale bar. @param unit_m one POV-Ray unit
std::string sheet_commands(const Sheet& sheet, double unit_m);

/// Returns gnuplot commands: walls and obstacles in grey.
std::string plan_commands(const config::Map& map);

/// Returns gnuplot commands: the landmarks with their names. @param boxed draws the names on white, for use over an
/// image
std::string landmark_commands(const config::Map& map, bool boxed);

/// Returns a gnuplot command that writes `text` at a point of the world.
std::string label_command(const std::string& text, double x_m, double y_m, const std::string& options);

/// Returns a data block of the positions of the poses.
std::string pose_block(const std::string& name, const std::vector<runlog::PoseRow>& poses);

/// Returns the arena from above, CV_8UC3 b g r, covering the map's bounds. The image is saved as `cache` and read from
/// there the next time.
/// Errors: kNotFound (no scene), those of sim_povray::render_overhead.
Result<cv::Mat> overhead_image(const config::Map& map, const std::filesystem::path& cache,
                               const sim_povray::RenderSettings& render);

}  // namespace twocone::report

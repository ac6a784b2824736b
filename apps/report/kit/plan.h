// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/report/kit/figure.h"
#include "apps/runlog/run_data.h"
#include "hal/image.h"

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

/// Returns a plot of the sheet over the arena from above (`overhead`, covering the sheet's world), or
/// over the plan of the map, walls and obstacles in grey. The landmarks and their names are drawn, and the key is
/// above.
Plot plot_over(const Sheet& sheet, const config::Map& map, const std::optional<Image>& overhead);

/// Returns the smallest rectangle around all poses, with a margin; nothing without a pose. Poses that are not finite do
/// not count.
std::optional<config::Bounds> extent_of(std::initializer_list<const std::vector<runlog::PoseRow>*> paths);

/// Returns a gnuplot command that writes `text` at a point of the world.
std::string label_command(const std::string& text, double x_m, double y_m, const std::string& options);

/// Returns a data block of the positions of the poses.
std::string pose_block(const std::string& name, const std::vector<runlog::PoseRow>& poses);

/// Returns the arena from above, covering the map's bounds. The image is saved as overhead.png among the
/// figures and read from there the next time. If it cannot be made, a note states why.
/// @param what_is the subject of the note and its verb, such as "Figure 7 is"
std::optional<Image> overhead_image(const DrawingTools& tools, const config::Map& map, std::string_view what_is);

}  // namespace twocone::report

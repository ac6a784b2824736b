// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "apps/compare/show/sections.h"
#include "apps/report/kit/figure.h"
#include "apps/report/kit/plan.h"

namespace twocone::compare {
namespace {

constexpr int kWidth_px = 1000, kTallest_px = 900;

struct Path {
  const char* name;  ///< of the data block
  std::string title;
  const std::vector<runlog::PoseRow>* poses;
  std::string_view colour;
  const char* style;
};

std::array<Path, 3> paths_of(const Comparison& comparison) {
  const std::string reference = comparison.reference.empty() ? "real" : "real (" + comparison.reference + ")";
  return {{{"odometry", "real odometry", &comparison.real_odometry, report::kOdometryColour, "dt (8,4)"},
           {"real", reference, &comparison.real_path, report::kTruthColour, "dt solid"},
           {"simulated", "simulated", &comparison.simulated_path, report::kFixColour, "dt (2,3)"}}};
}

/// Returns the map's walls; for a map without walls, a rectangle around all paths.
config::Bounds world_of(const Comparison& comparison, const std::array<Path, 3>& paths) {
  const config::Bounds& walls = comparison.map.bounds;
  if (walls.min_x_m < walls.max_x_m && walls.min_y_m < walls.max_y_m) return walls;
  return report::extent_of({paths[0].poses, paths[1].poses, paths[2].poses}).value_or(config::Bounds{});
}

}  // namespace

std::vector<report::Figure> draw_paths(const Comparison& comparison, const report::DrawingTools& tools) {
  const std::array<Path, 3> paths = paths_of(comparison);
  if (std::all_of(paths.begin(), paths.end(), [](const Path& path) { return path.poses->empty(); })) return {};
  std::optional<cv::Mat> arena;
  if (comparison.map.scene) arena = report::overhead_image(tools, comparison.map, "The paths are");
  const report::Sheet sheet = report::lay_out(world_of(comparison, paths), kWidth_px, kTallest_px);
  report::Plot plot = report::plot_over(sheet, comparison.map, arena);
  std::vector<std::string> plots;
  for (const Path& path : paths) {
    if (path.poses->empty()) continue;
    plot.commands += report::pose_block(path.name, *path.poses);
    // A white line below each line keeps it visible on any floor.
    plots.push_back(fmt::format("${} using 1:2 with lines lw 5 lc rgb '#ffffff' notitle", path.name));
  }
  for (const Path& path : paths) {
    if (path.poses->empty()) continue;
    plots.push_back(fmt::format("${} using 1:2 with lines lw 2.5 {} lc rgb '{}' title {}", path.name, path.style,
                                path.colour, report::gnuplot_string(path.title)));
  }
  plot.commands += report::plot_command(plots);

  report::Figure figure{"paths", "", "Both paths", "", ""};
  figure.caption = fmt::format("{} Axes in metres.", arena ? "Over the arena from above as POV-Ray sees it."
                                                           : "Over the plan drawn from the map.");
  if (comparison.is_rendered) {
    figure.caption += " The simulated images were rendered at the real run's poses, so there is one path.";
  }
  return {report::drawn(tools, std::move(figure), std::move(plot))};
}

}  // namespace twocone::compare

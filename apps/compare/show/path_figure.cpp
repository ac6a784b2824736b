// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "apps/compare/show/figures.h"
#include "apps/report/kit/palette.h"
#include "apps/report/kit/plan.h"

namespace twocone::compare {
namespace {

constexpr int kWidth_px = 1000, kTallest_px = 900;
constexpr int kJpegQuality = 82;

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
  constexpr double kMargin_m = 0.35;
  std::optional<config::Bounds> box;
  for (const Path& path : paths) {
    for (const runlog::PoseRow& pose : *path.poses) {
      if (!std::isfinite(pose.x_m) || !std::isfinite(pose.y_m)) continue;
      if (!box) box = {pose.x_m, pose.x_m, pose.y_m, pose.y_m};
      box = {std::min(box->min_x_m, pose.x_m), std::max(box->max_x_m, pose.x_m), std::min(box->min_y_m, pose.y_m),
             std::max(box->max_y_m, pose.y_m)};
    }
  }
  if (!box) return {};
  return {box->min_x_m - kMargin_m, box->max_x_m + kMargin_m, box->min_y_m - kMargin_m, box->max_y_m + kMargin_m};
}

std::optional<cv::Mat> arena_of(const Drawing& drawing, const sim_povray::RenderSettings& render) {
  if (!drawing.comparison.map.scene) return std::nullopt;
  Result<cv::Mat> image = report::overhead_image(drawing.comparison.map, drawing.folder / "overhead.png", render);
  if (image) return std::move(*image);
  drawing.notes.push_back(fmt::format("The paths are drawn over a plan instead of an image of the arena from above: {}",
                                      image.error().message));
  return std::nullopt;
}

}  // namespace

std::optional<report::Figure> draw_paths(const Drawing& drawing, const sim_povray::RenderSettings& render) {
  const Comparison& comparison = drawing.comparison;
  const std::array<Path, 3> paths = paths_of(comparison);
  if (std::all_of(paths.begin(), paths.end(), [](const Path& path) { return path.poses->empty(); })) {
    return std::nullopt;
  }
  const std::optional<cv::Mat> arena = arena_of(drawing, render);
  const report::Sheet sheet = report::lay_out(world_of(comparison, paths), kWidth_px, kTallest_px);
  report::Plot plot;
  plot.width_px = sheet.width_px;
  plot.height_px = sheet.height_px;
  plot.commands = report::sheet_commands(sheet, comparison.map.unit_m);
  if (arena) {
    report::Underlay underlay{sheet.left_px, sheet.top_px, sheet.plot_width_px, sheet.plot_height_px, {}};
    cv::imencode(".jpg", *arena, underlay.jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
    plot.underlay = std::move(underlay);
    plot.commands += "unset grid\n";
  } else {
    plot.commands += report::plan_commands(comparison.map);
  }
  plot.commands += report::landmark_commands(comparison.map, arena.has_value()) +
                   "set key outside top center horizontal maxrows 1\n";
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
  return report::drawn(drawing.gnuplot, drawing.notes, std::move(figure), std::move(plot));
}

}  // namespace twocone::compare

// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/show/sections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <fmt/format.h>

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

using report::gnuplot_string;
using report::number;

constexpr double kMmPerM = 1000;
/// Limit for one panel; a page with more points is too slow in browsers.
constexpr std::size_t kMostPoints = 2000;

enum class Axis { kTime, kRange };

/// One of the three panels beside each other.
struct Panel {
  std::string title;
  const std::vector<ResidualPoint>* points;
  bool after;
};

std::optional<double> residual_mm(const ResidualPoint& point, bool after) {
  const std::optional<double> value_m = after ? point.after_m : std::optional(point.before_m);
  return value_m && std::isfinite(*value_m) ? std::optional(*value_m * kMmPerM) : std::nullopt;
}

std::optional<double> place_of(const ResidualPoint& point, Axis axis) {
  const double value = axis == Axis::kTime ? point.t_s : point.range_m;
  return std::isfinite(value) && (axis == Axis::kTime || value > 0) ? std::optional(value) : std::nullopt;
}

std::array<Panel, 3> panels_of(const Comparison& comparison) {
  return {{{"simulated", &comparison.simulated_residuals, false},
           {"real, as measured", &comparison.real_residuals, false},
           {"real, corrected", &comparison.real_residuals, true}}};
}

std::size_t stride_of(const Panel& panel) { return std::max<std::size_t>(1, panel.points->size() / kMostPoints); }

std::string name_of(const Comparison& comparison, std::size_t landmark) {
  return landmark < comparison.map.landmarks.size() ? comparison.map.landmarks[landmark].name
                                                    : fmt::format("landmark {}", landmark);
}

std::string colour_of(const Comparison& comparison, std::size_t landmark) {
  return landmark < comparison.map.landmarks.size() ? report::line_colour(comparison.map.landmarks[landmark].colour)
                                                    : std::string(report::kPaperColour);
}

/// Returns one landmark's points of a panel: place and residual in mm. Points beyond the limit are drawn at the limit.
std::string rows_of(const Panel& panel, std::size_t landmark, Axis axis, double limit_mm, bool beyond) {
  std::string rows;
  std::size_t count = 0;
  for (const ResidualPoint& point : *panel.points) {
    if (point.landmark != landmark || count++ % stride_of(panel) != 0) continue;
    const std::optional<double> mm = residual_mm(point, panel.after);
    const std::optional<double> place = place_of(point, axis);
    if (!mm || !place || (std::abs(*mm) > limit_mm) != beyond) continue;
    rows += fmt::format("{} {}\n", number(place), number(std::clamp(*mm, -limit_mm, limit_mm)));
  }
  return rows;
}

/// Margins of the panels, as fractions of the figure's width.
constexpr double kLeft = 0.07, kRight = 0.99, kBetween = 0.012;

constexpr double kResiduals_px = 1060, kPanels_px = 350, kKeyRow_px = 22;

/// A landmark's name in the key above the panels. gnuplot's own key has the width of one panel only.
struct KeyEntry {
  std::size_t landmark;
  double x_px;
  int row;
};

std::vector<KeyEntry> key_of(const Comparison& comparison, const std::set<std::size_t>& landmarks) {
  constexpr double kLetter_px = 8, kMark_px = 34;  // widths of a letter in the figures, rounded up, and of a mark
  std::vector<KeyEntry> key;
  double x_px = kLeft * kResiduals_px;
  int row = 0;
  for (const std::size_t landmark : landmarks) {
    const double width_px = kLetter_px * double(name_of(comparison, landmark).size()) + kMark_px;
    if (!key.empty() && x_px + width_px > kRight * kResiduals_px) {
      x_px = kLeft * kResiduals_px;
      ++row;
    }
    key.push_back({landmark, x_px, row});
    x_px += width_px;
  }
  return key;
}

std::string key_commands(const Comparison& comparison, const std::vector<KeyEntry>& key, double height_px) {
  std::string text;
  for (const KeyEntry& entry : key) {
    const double y_px = 14 + kKeyRow_px * entry.row;
    text += fmt::format(
        "set label {} at screen {:.5f},{:.5f} left point pt 7 ps 0.8 lc rgb '{}' offset 0.9,0 textcolor rgb "
        "'#333333'\n",
        gnuplot_string(name_of(comparison, entry.landmark)), (entry.x_px + 6) / kResiduals_px, 1 - y_px / height_px,
        colour_of(comparison, entry.landmark));
  }
  return text;
}

std::string panel_commands(const Comparison& comparison, const std::set<std::size_t>& landmarks, Axis axis,
                           double limit_mm, std::size_t index) {
  const Panel panel = panels_of(comparison)[index];
  const double width = (kRight - kLeft - 2 * kBetween) / 3;
  const double left = kLeft + double(index) * (width + kBetween);
  std::string text =
      fmt::format("set lmargin at screen {:.4f}\nset rmargin at screen {:.4f}\nset title {} offset 0,-0.5\n", left,
                  left + width, gnuplot_string(panel.title));
  text += index == 0 ? "set ylabel 'range residual / mm' offset 1,0\nset format y '%g'\n"
                     : "unset ylabel\nset format y ''\n";
  std::vector<std::string> plots;
  for (const std::size_t landmark : landmarks) {
    for (const bool beyond : {false, true}) {
      const std::string rows = rows_of(panel, landmark, axis, limit_mm, beyond);
      if (rows.empty()) continue;
      const std::string name = fmt::format("p{}_{}{}", index, landmark, beyond ? "_beyond" : "");
      text += report::data_block(name, rows);
      plots.push_back(fmt::format("${} using 1:2 with points pt {} lc rgb '{}' notitle", name,
                                  beyond ? "8 ps 0.6" : "7 ps 0.35", colour_of(comparison, landmark)));
    }
  }
  return text + report::plot_command(plots) + "unset label\n";
}

/// Returns a figure without an SVG if there is no residual to draw.
report::Figure draw(const Comparison& comparison, const report::DrawingTools& tools, Axis axis) {
  std::set<std::size_t> landmarks;
  std::vector<double> sizes_mm;
  double first = 0, last = 0;
  std::size_t stride = 1;
  for (const Panel& panel : panels_of(comparison)) {
    stride = std::max(stride, stride_of(panel));
    for (const ResidualPoint& point : *panel.points) {
      const std::optional<double> mm = residual_mm(point, panel.after);
      const std::optional<double> place = place_of(point, axis);
      if (!mm || !place) continue;
      if (sizes_mm.empty()) first = last = *place;
      first = std::min(first, *place);
      last = std::max(last, *place);
      landmarks.insert(point.landmark);
      sizes_mm.push_back(std::abs(*mm));
    }
  }
  if (sizes_mm.empty()) return {};
  constexpr double kLeastLimit_mm = 1e-3;
  const double limit_mm = std::max(report::readable_limit(sizes_mm), kLeastLimit_mm);
  const double margin = std::max(0.03 * (last - first), 0.01);
  const bool time = axis == Axis::kTime;

  report::Plot plot;
  const std::vector<KeyEntry> key = key_of(comparison, landmarks);
  const double key_px = kKeyRow_px * (key.back().row + 1);
  const double height_px = kPanels_px + key_px;
  plot.width_px = int(kResiduals_px);
  plot.height_px = int(height_px);
  plot.commands = fmt::format(
      "set xrange [{:.9g}:{:.9g}]\nset yrange [{:.9g}:{:.9g}]\nset xzeroaxis lc rgb '#777777' lw 1 dt solid\n"
      "set xlabel '{}' offset 0,0.4\nset tmargin at screen {:.5f}\nset bmargin at screen {:.5f}\nunset key\n"
      "{}set multiplot\n",
      first - margin, last + margin, -1.08 * limit_mm, 1.08 * limit_mm, time ? "time / s" : "range / m",
      1 - (key_px + 30) / height_px, 62 / height_px, key_commands(comparison, key, height_px));
  for (std::size_t i = 0; i < panels_of(comparison).size(); ++i) {
    plot.commands += panel_commands(comparison, landmarks, axis, limit_mm, i);
  }
  plot.commands += "unset multiplot\n";

  report::Figure figure{time ? "residuals_time" : "residuals_range", "",
                        time ? "Range residuals against time" : "Range residuals against range"};
  figure.caption =
      "Each measured range minus the distance to the reference pose. Corrected: after correction of the differences "
      "that were found. All three panels have the same scale.";
  if (std::ranges::max(sizes_mm) > limit_mm) {
    figure.caption += " Triangles mark points beyond the axis.";
  }
  if (stride > 1) figure.caption += fmt::format(" One in {} points is drawn.", stride);
  return report::drawn(tools, std::move(figure), std::move(plot));
}

}  // namespace

std::vector<report::Figure> draw_paths(const Comparison& comparison, const report::DrawingTools& tools) {
  const std::array<Path, 3> paths = paths_of(comparison);
  if (std::ranges::all_of(paths, [](const Path& path) { return path.poses->empty(); })) return {};
  std::optional<Image> arena;
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

  report::Figure figure{"paths", "", "Both paths"};
  figure.caption = fmt::format("{} Axes in metres.", arena ? "Over the arena from above as POV-Ray sees it."
                                                           : "Over the plan drawn from the map.");
  if (comparison.is_rendered) {
    figure.caption += " The simulated images were rendered at the real run's poses, so there is one path.";
  }
  return {report::drawn(tools, std::move(figure), std::move(plot))};
}

std::vector<report::Figure> draw_residuals(const Comparison& comparison, const report::DrawingTools& tools) {
  return {draw(comparison, tools, Axis::kTime), draw(comparison, tools, Axis::kRange)};
}

}  // namespace twocone::compare

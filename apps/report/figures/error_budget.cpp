// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <boost/algorithm/string/replace.hpp>

#include "apps/report/kit/html.h"
#include "apps/report/page.h"
#include "base/quantile.h"

namespace twocone::report {
namespace {

const std::vector<runlog::PoseRow>& path_of(const runlog::RunData& run) {
  if (!run.truth.empty()) return run.truth;
  return run.estimate.empty() ? run.odometry : run.estimate;
}

/// Sets the speed and the turn rate to their root mean squares over the path. If the path has fewer than two poses, the
/// settings keep their values.
void set_motion(const std::vector<runlog::PoseRow>& path, error_budget::ErrorBudgetSettings& settings) {
  double speed_squares = 0, turn_squares = 0;
  int count = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double step_s = path[i].t_s - path[i - 1].t_s;
    if (!(step_s > 0)) continue;
    const double turn_rad = localisation::wrap_angle_rad(path[i].heading_rad - path[i - 1].heading_rad);
    const double way_m = std::hypot(path[i].x_m - path[i - 1].x_m, path[i].y_m - path[i - 1].y_m);
    speed_squares += std::pow(way_m / step_s, 2);
    turn_squares += std::pow(turn_rad / step_s, 2);
    ++count;
  }
  if (count == 0) return;
  settings.speed_mps = std::sqrt(speed_squares / count);
  settings.turn_rate_radps = std::sqrt(turn_squares / count);
}

std::string three_digits_mm(double metres) {
  const double value = metres * kMmPerM;
  return value < 5e-4 ? std::string("0") : fmt::format("{:#.3g}", value);
}

/// Smaller values are not drawn, because a logarithmic axis has no zero.
constexpr double kLeastDrawn_mm = 0.01;

std::string drawn_mm(double metres) {
  const double value_mm = metres * kMmPerM;
  return number(value_mm >= kLeastDrawn_mm ? std::optional(value_mm) : std::nullopt);
}

/// Returns the text of a tic label for gnuplot, which interprets '%' in it as the beginning of a number's format.
std::string tic_string(const std::string& text) { return gnuplot_string(boost::replace_all_copy(text, "%", "%%")); }

}  // namespace

RunErrorBudget error_budget_of(const runlog::RunData& run, int draws, int pose_step) {
  error_budget::ErrorBudgetSettings settings = error_budget::settings_for(run.robot);
  settings.draws = draws;
  const std::vector<runlog::PoseRow>& path = path_of(run);
  set_motion(path, settings);
  std::vector<double> noise_px;
  for (const runlog::SightingRow& row : run.sightings) {
    if (row.edge_noise_px && *row.edge_noise_px > 0 && std::isfinite(*row.edge_noise_px))
      noise_px.push_back(*row.edge_noise_px);
  }
  if (!noise_px.empty()) settings.edge_noise_px = base::median(noise_px);
  std::vector<localisation::Pose> poses;
  for (std::size_t i = 0; i < path.size(); i += std::size_t(pose_step)) {
    poses.push_back({path[i].x_m, path[i].y_m, path[i].heading_rad});
  }
  if (poses.empty()) poses = error_budget::grid_poses(run.robot, run.map);
  return {error_budget::error_budget(run.robot, run.map, poses, settings), settings, !noise_px.empty()};
}

std::string error_budget_table(const RunErrorBudget& run_error_budget) {
  const error_budget::ErrorBudget& error_budget = run_error_budget.error_budget;
  html::Table table(
      "Root mean square error in mm that each source adds",
      html::head_row({"", "", fmt::format("range at {:g} m", error_budget.range_m), "position"}, {1, 1, 2, 2}) +
          html::head_row({"source", "wrong by", "analytic", "Monte Carlo", "analytic", "Monte Carlo"}));
  const auto add = [&](const error_budget::ErrorBudgetLine& line, std::string_view attributes) {
    std::vector<std::string> cells{escape(line.source), escape(line.size)};
    for (const auto& [c, count] : {std::pair{line.range, error_budget.ranges}, {line.position, error_budget.poses}}) {
      cells.push_back(count > 0 ? three_digits_mm(c.analytic_m) : "\u2013");
      cells.push_back(count > 0 ? three_digits_mm(c.monte_carlo_m) : "\u2013");
    }
    table.add(cells, attributes);
  };
  for (const error_budget::ErrorBudgetLine& line : error_budget.lines) add(line, "");
  add(error_budget.total, "class=\"total\"");

  std::string notes = fmt::format(
      "Ranges over {} landmarks and bearings, positions over {} poses of this run; noise of the outlines {:.3f} px "
      "({}); skew at {:.2f} m/s and {:.2f} rad/s. Each number is a standard deviation. The Monte Carlo uses {} draws, "
      "so its relative statistical error is {:.1f} %. Where it differs by more from the analytic value, the source is "
      "too large for linear propagation.",
      error_budget.ranges, error_budget.poses, run_error_budget.settings.edge_noise_px,
      run_error_budget.noise_measured ? "measured" : "assumed", run_error_budget.settings.speed_mps,
      run_error_budget.settings.turn_rate_radps, error_budget.draws, 100 / std::sqrt(2.0 * error_budget.draws));
  if (error_budget.withheld_ranges + error_budget.withheld_positions > 0) {
    notes += fmt::format(" Among the draws {} ranges and {} positions were withheld; no number includes them.",
                         error_budget.withheld_ranges, error_budget.withheld_positions);
  }
  return table.str() + html::text("p", notes, "class=\"soft\"");
}

Figure draw_error_budget(const Drawing& drawing, const error_budget::ErrorBudget& error_budget) {
  if (error_budget.ranges == 0 && error_budget.poses == 0) return {};
  std::vector<error_budget::ErrorBudgetLine> lines = error_budget.lines;
  std::stable_sort(lines.begin(), lines.end(), [](const auto& a, const auto& b) {
    return a.position.analytic_m + a.range.analytic_m > b.position.analytic_m + b.range.analytic_m;
  });
  lines.insert(lines.begin(), error_budget.total);

  std::string data, tics;
  double largest_mm = 1;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const error_budget::ErrorBudgetLine& line = lines[i];
    data +=
        fmt::format("{} {} {} {} {}\n", -double(i), drawn_mm(line.range.analytic_m), drawn_mm(line.range.monte_carlo_m),
                    drawn_mm(line.position.analytic_m), drawn_mm(line.position.monte_carlo_m));
    const std::string name = line.size.empty() ? line.source : line.source + ": " + line.size;
    tics += fmt::format("{}{} {}", i > 0 ? ", " : "", tic_string(name), -double(i));
    for (const error_budget::Contribution& c : {line.range, line.position}) {
      largest_mm = std::max({largest_mm, c.analytic_m * kMmPerM, c.monte_carlo_m * kMmPerM});
    }
  }
  Plot plot{.height_px = 130 + 27 * int(lines.size())};
  plot.commands = data_block("error_budget", data);
  plot.commands += fmt::format(
      "set logscale x\nset xrange [{0:g}:{1:.6g}]\nset yrange [{2:g}:0.6]\nset ytics ({3})\nset format x '%g'\n"
      "set xlabel 'root mean square / mm' offset 0,0.3\nset key outside top center horizontal\nunset grid\n"
      "set grid xtics back lc rgb '#e4e4e4' lw 1 dt solid\n",
      kLeastDrawn_mm, 1.6 * largest_mm, -double(lines.size()) + 0.4, tics);
  // Boxes from the axis' end to the value: x, y, xlow, xhigh, ylow, yhigh.
  const auto bars = [&](int column, double above, double below, std::string_view colour, const std::string& name) {
    return fmt::format(
        "$error_budget using {0}:1:({1:g}):{0}:($1 {2:+g}):($1 {3:+g}) with boxxyerror fs solid 0.75 noborder "
        "lc rgb '{4}' title {5}",
        column, kLeastDrawn_mm, below, above, colour, gnuplot_string(name));
  };
  const auto marks = [&](int column, double at, const std::string& title) {
    return fmt::format("$error_budget using {}:($1 {:+g}) with points pt 6 ps 0.8 lw 1.5 lc rgb '{}' {}", column, at,
                       kTruthColour, title);
  };
  plot.commands +=
      plot_command({bars(2, 0.36, 0.02, kOdometryColour, fmt::format("range at {:g} m", error_budget.range_m)),
                    bars(4, -0.02, -0.36, kFixColour, "position"), marks(3, 0.19, "title 'Monte Carlo'"),
                    marks(5, -0.19, "notitle")});

  const std::string caption = fmt::format(
      "Error that each source adds if it is wrong by the standard deviation beside its name. Bars: linear "
      "propagation; circles: {} draws each. Values below {:g} mm are not drawn.",
      error_budget.draws, kLeastDrawn_mm);
  return drawn(drawing, {"error_budget", "", "The error budget", caption}, std::move(plot));
}

}  // namespace twocone::report

// SPDX-License-Identifier: Apache-2.0
#include "apps/report/run_error_budget.h"

#include <cmath>

#include <fmt/format.h>

#include "apps/report/figures/series.h"
#include "apps/report/kit/html.h"
#include "base/quantile.h"

namespace twocone::report {
namespace {

const std::vector<runlog::PoseRow>& path_of(const runlog::RunData& run) {
  if (!run.truth.empty()) return run.truth;
  return run.estimate.empty() ? run.odometry : run.estimate;
}

/// Sets the speed and the turn rate to their root mean squares over the path. Keeps the settings' values where the path
/// has fewer than two poses.
void set_motion(const std::vector<runlog::PoseRow>& path, error_budget::ErrorBudgetSettings& settings) {
  double speed_squares = 0;
  double turn_squares = 0;
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
  if (!noise_px.empty()) settings.edge_noise_px = base::median(std::move(noise_px));
  std::vector<localisation::Pose> poses;
  for (std::size_t i = 0; i < path.size(); i += std::size_t(pose_step)) {
    poses.push_back({path[i].x_m, path[i].y_m, path[i].heading_rad});
  }
  if (poses.empty()) poses = error_budget::grid_poses(run.robot, run.map);
  return {error_budget::error_budget(run.robot, run.map, poses, settings), settings.edge_noise_px, !noise_px.empty(),
          settings.speed_mps, settings.turn_rate_radps};
}

std::string error_budget_table(const RunErrorBudget& run_error_budget) {
  const error_budget::ErrorBudget& error_budget = run_error_budget.error_budget;
  html::Table table(
      "Root mean square error in three_digits_mm that each source adds",
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
      error_budget.ranges, error_budget.poses, run_error_budget.edge_noise_px,
      run_error_budget.noise_measured ? "measured" : "assumed", run_error_budget.speed_mps,
      run_error_budget.turn_rate_radps, error_budget.draws, 100 / std::sqrt(2.0 * error_budget.draws));
  if (error_budget.withheld_ranges + error_budget.withheld_positions > 0) {
    notes += fmt::format(" Among the draws {} ranges and {} positions were withheld; no number includes them.",
                         error_budget.withheld_ranges, error_budget.withheld_positions);
  }
  return table.str() + html::text("p", notes, "class=\"soft\"");
}

}  // namespace twocone::report

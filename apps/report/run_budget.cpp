// SPDX-License-Identifier: Apache-2.0
#include "apps/report/run_budget.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "apps/report/markup.h"
#include "apps/report/page/html.h"

namespace twocone::report {
namespace {

constexpr double kMmPerM = 1000;

const std::vector<runs::PoseRow>& path_of(const runs::RunData& run) {
  if (!run.truth.empty()) return run.truth;
  return run.estimate.empty() ? run.odometry : run.estimate;
}

/// Root mean squares over the path; what the settings say where it has no two poses.
void set_motion(const std::vector<runs::PoseRow>& path, budget::BudgetSettings& settings) {
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

std::string mm(double metres) {
  const double value = metres * kMmPerM;
  return value < 5e-4 ? std::string("0") : fmt::format("{:#.3g}", value);
}

}  // namespace

RunBudget budget_of(const runs::RunData& run, int draws, int pose_step) {
  if (pose_step < 1) throw std::invalid_argument(fmt::format("budget_of: pose_step is {}, must be >= 1", pose_step));
  budget::BudgetSettings settings = budget::settings_for(run.robot);
  settings.draws = draws;
  const std::vector<runs::PoseRow>& path = path_of(run);
  set_motion(path, settings);
  std::vector<double> noise_px;
  for (const runs::SightingRow& row : run.sightings) {
    if (row.edge_noise_px && *row.edge_noise_px > 0 && std::isfinite(*row.edge_noise_px))
      noise_px.push_back(*row.edge_noise_px);
  }
  if (!noise_px.empty()) {
    const auto middle = noise_px.begin() + std::ptrdiff_t(noise_px.size() / 2);
    std::nth_element(noise_px.begin(), middle, noise_px.end());
    settings.edge_noise_px = *middle;
  }
  std::vector<localisation::Pose> poses;
  for (std::size_t i = 0; i < path.size(); i += std::size_t(pose_step)) {
    poses.push_back({path[i].x_m, path[i].y_m, path[i].heading_rad});
  }
  if (poses.empty()) poses = budget::grid_poses(run.robot, run.map);
  return {budget::error_budget(run.robot, run.map, poses, settings), settings.edge_noise_px, !noise_px.empty(),
          settings.speed_mps, settings.turn_rate_radps};
}

std::string budget_table(const RunBudget& run_budget) {
  const budget::Budget& budget = run_budget.budget;
  html::Table table("Root mean square error in mm that each source adds",
                    html::head_row({"", "", fmt::format("range at {:g} m", budget.range_m), "position"}, {1, 1, 2, 2}) +
                        html::head_row({"source", "wrong by", "analytic", "Monte Carlo", "analytic", "Monte Carlo"}));
  const auto add = [&](const budget::BudgetLine& line, std::string_view attributes) {
    std::vector<std::string> cells{escape(line.source), escape(line.size)};
    for (const auto& [c, count] : {std::pair{line.range, budget.ranges}, {line.position, budget.poses}}) {
      cells.push_back(count > 0 ? mm(c.analytic_m) : "\u2013");
      cells.push_back(count > 0 ? mm(c.monte_carlo_m) : "\u2013");
    }
    table.add(cells, attributes);
  };
  for (const budget::BudgetLine& line : budget.lines) add(line, "");
  add(budget.total, "class=\"total\"");

  std::string notes = fmt::format(
      "Ranges over {} pillars and bearings, positions over {} poses of this run; noise of the outlines {:.3f} px ({}); "
      "skew at {:.2f} m/s and {:.2f} rad/s. Each number is a standard deviation: {} draws for the Monte Carlo, whose "
      "own "
      "error is {:.1f} % of itself. Where it differs by more, the source is too large for a linear view of it.",
      budget.ranges, budget.poses, run_budget.edge_noise_px, run_budget.noise_measured ? "measured" : "assumed",
      run_budget.speed_mps, run_budget.turn_rate_radps, budget.draws, 100 / std::sqrt(2.0 * budget.draws));
  if (budget.withheld_ranges + budget.withheld_positions > 0) {
    notes += fmt::format(" Withheld among the draws: {} ranges and {} positions; they count in no number.",
                         budget.withheld_ranges, budget.withheld_positions);
  }
  return table.str() + html::text("p", notes, "class=\"soft\"");
}

}  // namespace twocone::report

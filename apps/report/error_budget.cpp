// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "apps/report/data.h"
#include "base/quantile.h"

namespace twocone::report {
namespace {

using Json = nlohmann::ordered_json;

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

Json contribution_json(const error_budget::Contribution& contribution) {
  return {{"analytic_m", contribution.analytic_m}, {"monte_carlo_m", contribution.monte_carlo_m}};
}

Json line_json(const error_budget::ErrorBudgetLine& line) {
  return {{"source", line.source},
          {"size", line.size},
          {"range", contribution_json(line.range)},
          {"position", contribution_json(line.position)}};
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
  if (!noise_px.empty()) settings.edge_noise_px = base::median(noise_px);
  std::vector<localisation::Pose> poses;
  for (std::size_t i = 0; i < path.size(); i += std::size_t(pose_step)) {
    poses.push_back({path[i].x_m, path[i].y_m, path[i].heading_rad});
  }
  if (poses.empty()) poses = error_budget::grid_poses(run.robot, run.map);
  return {error_budget::error_budget(run.robot, run.map, poses, settings), settings, !noise_px.empty()};
}

Json error_budget_json(const RunErrorBudget& run_error_budget) {
  const auto& [budget, settings, noise_measured] = run_error_budget;
  Json lines = Json::array({line_json(budget.total)});
  for (const error_budget::ErrorBudgetLine& line : budget.lines) lines.push_back(line_json(line));
  return {{"lines", std::move(lines)},
          {"range_m", budget.range_m},
          {"ranges", budget.ranges},
          {"poses", budget.poses},
          {"draws", budget.draws},
          {"withheld_ranges", budget.withheld_ranges},
          {"withheld_positions", budget.withheld_positions},
          {"edge_noise_px", settings.edge_noise_px},
          {"noise_measured", noise_measured},
          {"speed_mps", settings.speed_mps},
          {"turn_rate_radps", settings.turn_rate_radps}};
}

}  // namespace twocone::report

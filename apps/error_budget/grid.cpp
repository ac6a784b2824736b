// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "apps/behaviours/arena.h"
#include "apps/config/to_layers.h"
#include "apps/error_budget/error_budget.h"

namespace twocone::error_budget {

std::vector<localisation::Pose> grid_poses(const config::Robot& robot, const config::Map& map) {
  constexpr int kSteps = 6;
  // The golden angle spreads the headings over the circle without repetition, for any number of poses.
  constexpr double kTurn_rad = 2.399963229728653;
  const behaviours::Arena arena = config::to_arena(map);
  const Eigen::Vector2d size_m = arena.max_m - arena.min_m;
  const double step_m = size_m.maxCoeff() / kSteps;
  std::vector<localisation::Pose> poses;
  for (int column = 0; column < kSteps; ++column) {
    for (int row = 0; row < kSteps; ++row) {
      const double x_m = arena.min_m.x() + (column + 0.5) * step_m;
      const double y_m = arena.min_m.y() + (row + 0.5) * step_m;
      if (!(x_m < arena.max_m.x()) || !(y_m < arena.max_m.y())) continue;
      if (arena.clearance_m({x_m, y_m}) < robot.body_radius_m) continue;
      poses.push_back({x_m, y_m, localisation::wrap_angle_rad(kTurn_rad * double(poses.size()))});
    }
  }
  return poses;
}

}  // namespace twocone::error_budget

// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/start_check.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "apps/files/to_layers.h"

namespace twocone::runs {
namespace {

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

}  // namespace

Result<std::optional<std::string>> compare_start(const files::Robot& robot, const sim_povray::ShownCamera& lower,
                                                 const std::string& place) {
  const localisation::Pose start = files::to_start_pose(robot);
  const double apart_m = std::hypot(lower.x_m - start.x_m, lower.y_m - start.y_m);
  std::string shown = fmt::format("({:.3f}, {:.3f}) m", lower.x_m, lower.y_m);
  std::string apart = fmt::format("{:.0f} mm", 1000 * apart_m);
  double turned_deg = 0;
  if (lower.x_axis_rad) {
    const double heading_rad = localisation::wrap_angle_rad(*lower.x_axis_rad - robot.rig.lower.azimuth_rad);
    turned_deg = degrees(std::abs(localisation::wrap_angle_rad(heading_rad - start.heading_rad)));
    shown += fmt::format(", heading {:.2f} degrees", degrees(heading_rad));
    apart += fmt::format(" and {:.1f} degrees", turned_deg);
  } else {
    shown += " (its heading cannot be read off camera lower, whose picture's x axis is not level)";
  }
  if (apart_m < kStartWarning_m && turned_deg < kStartWarning_deg) return std::optional<std::string>();
  std::string told = fmt::format(
      "{}: start is ({:.3f}, {:.3f}) m, heading {:.2f} degrees, but the scene shows the robot at {}: {} apart", place,
      start.x_m, start.y_m, degrees(start.heading_rad), shown, apart);
  if (apart_m > robot.body_radius_m) {
    return Error{ErrorCode::kRefused,
                 fmt::format("{}, more than body.radius_m of {} m: say in start where the scene shows it", told,
                             robot.body_radius_m)};
  }
  return std::optional(std::move(told));
}

}  // namespace twocone::runs

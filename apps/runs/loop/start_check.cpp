// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/start_check.h"

#include <cmath>
#include <numbers>
#include <tuple>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/runs/loop/frame_taker.h"
#include "vision/rim.h"

namespace twocone::runs {
namespace {

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

}  // namespace

Result<std::optional<std::string>> compare_start(const config::Robot& robot, const sim_povray::ShownCamera& lower,
                                                 const std::string& place) {
  const localisation::Pose start = config::to_start_pose(robot);
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
    shown += " (its heading cannot be read off camera lower, whose image's x axis is not level)";
  }
  if (apart_m < kStartWarning_m && turned_deg < kStartWarning_deg) return std::optional<std::string>();
  std::string warning = fmt::format(
      "{}: start is ({:.3f}, {:.3f}) m, heading {:.2f} degrees, but the scene shows the robot at {}: {} apart", place,
      start.x_m, start.y_m, degrees(start.heading_rad), shown, apart);
  if (apart_m > robot.body_radius_m) {
    return Error(ErrorCode::kRefused, "{}, more than body.radius_m of {} m: set start to where the scene shows it",
                 warning, robot.body_radius_m);
  }
  return std::optional(std::move(warning));
}

StartCheck::StartCheck(const config::Robot& robot, const sim_povray::PlaceSettings& place,
                       const std::string& robot_name, std::string start_place)
    : robot_(robot), start_place_(std::move(start_place)) {
  std::promise<Result<sim_povray::ShownCamera>> answer;
  shown_ = answer.get_future();
  asker_ = std::jthread([place, robot_name, answer = std::move(answer)](const std::stop_token& stop) mutable {
    try {
      answer.set_value(sim_povray::shown_camera(place, robot_name, "lower", stop));
    } catch (const std::exception& error) {  // for example, no file descriptor or no memory is left
      answer.set_value(Error{ErrorCode::kUnavailable, error.what()});
    }
  });
}

Result<std::optional<std::string>> StartCheck::wait(const std::atomic<bool>& stop) {
  while (shown_.wait_for(kStopSlice) != std::future_status::ready) {
    if (stop) return Error{ErrorCode::kCancelled, "interrupted while the start was checked"};
  }
  const auto shown = shown_.get();
  if (!shown) {
    return std::optional(fmt::format("{}: start could not be compared with where the scene shows the robot: {}",
                                     start_place_, shown.error().message));
  }
  return compare_start(robot_, *shown, start_place_);
}

std::vector<std::string> rim_warnings(const config::Robot& robot, const Image& lower, const Image& upper,
                                      double limit_px) {
  std::vector<std::string> warnings;
  const vision::Rig rig = config::to_assumed_rig(robot);
  for (const auto& [view, image, mirror] : {std::tuple{"lower", &lower, &rig.lower}, {"upper", &upper, &rig.upper}}) {
    const auto rgb = to_rgb8(*image);
    if (!rgb) continue;
    const cv::Mat pixels = estimation::as_mat(*rgb);
    const vision::RimCircle expected = vision::rim_in_image(*mirror);
    const auto rim = vision::find_rim(pixels, expected);
    if (!rim && !vision::rim_may_show(pixels, expected)) {
      warnings.push_back(fmt::format(
          "note: the {0} mirror's rim does not stand out in the first image: rig.{0} was not compared with it", view));
    } else if (!rim) {
      warnings.push_back(fmt::format(
          "warning: no mirror rim was found in the first {} image near the one that rig.{} states", view, view));
    } else if (std::abs(rim->radius_px - expected.radius_px) > limit_px ||
               (rim->centre_px - expected.centre_px).norm() > limit_px) {
      warnings.push_back(fmt::format(
          "warning: the {} mirror's rim is seen at centre ({:.1f}, {:.1f}) px with radius {:.1f} px, but rig.{} states "
          "({:.1f}, {:.1f}) and {:.1f}{}: ranges will be wrong; correct the robot file",
          view, rim->centre_px.x(), rim->centre_px.y(), rim->radius_px, view, expected.centre_px.x(),
          expected.centre_px.y(), expected.radius_px, mirror->settings().distortion ? " as its lens bends them" : ""));
    }
  }
  return warnings;
}

}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <sstream>
#include <stop_token>

#include <fmt/format.h>

#include "base/child_process.h"
#include "drivers/sim_povray/render/camera_mask.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/scene/scene.h"
#include "drivers/sim_povray/shown_camera.h"

namespace twocone::sim_povray {
namespace {

/// Greatest tilt of the image's x axis. A smaller tilt changes its direction far less than the required accuracy.
constexpr double kLevel_rad = std::numbers::pi / 180;

/// Returns scene text that makes POV-Ray report where the camera is and where its image's x axis points, and stop.
std::string question(const std::string& prefix, const CameraVectors& camera) {
  return fmt::format(
      "{1}#declare {0}Carry = function {{ transform {{{2} }} }} "
      "#declare {0}At = {0}Carry({0}Location.x, {0}Location.y, {0}Location.z); #declare {0}To = "
      "{0}Carry({0}Location.x + {0}Right.x, {0}Location.y + {0}Right.y, {0}Location.z + {0}Right.z); "
      "#error concat(\"{3}\", vstr(3, {0}At, \" \", 0, 9), \" \", vstr(3, {0}To, \" \", 0, 9), \" .\") ",
      prefix, camera.declarations, camera.transformations, kPovrayAnswer);
}

}  // namespace

Result<ShownCamera> shown_camera(const PlaceSettings& place, const std::string& robot_name,
                                 const std::string& camera_name, const std::stop_token& stop) {
  check(place);
  const auto scene = Scene::read(place.scene);
  if (!scene) return scene.error();
  const auto robot = scene->robot(robot_name);
  if (!robot) return robot.error();
  const auto camera = scene->camera_of(*robot, camera_name);
  if (!camera) return camera.error();
  const auto vectors = camera_vectors(*scene, *camera);
  if (!vectors) {
    return Error{vectors.error().code, fmt::format("camera {}: {}", camera->name, vectors.error().message)};
  }
  const auto povray = confined_povray(place, *scene);
  if (!povray) return povray.error();

  base::StopSignal signal;
  const std::stop_callback raise(stop, [&signal] { signal.raise(); });
  const auto answer = povray->ask(fmt::format("place of view {}", camera->name),
                                  scene->with({{camera->begin, question(scene->prefix(), *vectors)}}), signal.fd());
  if (!answer) return answer.error();
  // POV-Ray's x, y and z are the world's x, z and y.
  double x = 0, up = 0, y = 0, to_x = 0, to_up = 0, to_y = 0;
  std::istringstream numbers(*answer);
  if (!(numbers >> x >> up >> y >> to_x >> to_up >> to_y)) {
    return Error{ErrorCode::kBadData, fmt::format("POV-Ray answered '{}' for view {}", *answer, camera->name)};
  }
  ShownCamera shown{x * place.unit_m, y * place.unit_m, {}};
  const double level = std::hypot(to_x - x, to_y - y);
  if (level > 0 && std::abs(to_up - up) < level * std::tan(kLevel_rad)) {
    shown.x_axis_rad = std::atan2(to_y - y, to_x - x);
  }
  return shown;
}

}  // namespace twocone::sim_povray

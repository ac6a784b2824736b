// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene_views.h"

#include <cmath>
#include <numbers>
#include <sstream>

#include <fmt/format.h>

#include "base/child_process.h"
#include "base/errors.h"
#include "drivers/sim_povray/render/mirror_finder.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/scene/scene.h"

namespace twocone::sim_povray {
namespace {

/// Images for people have smooth edges.
constexpr int kAntialias = 3;

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

int checked_height_px(const OverheadView& view, double unit_m) {
  base::Complaints complaints;
  complaints.span("", 'x', view.min_x_m, view.max_x_m);
  complaints.span("", 'y', view.min_y_m, view.max_y_m);
  complaints.positive("height_m", view.height_m, "m");
  complaints.within("width_px", view.width_px, 1, kMaxSide_px);
  const double height_px = std::round(view.width_px * (view.max_y_m - view.min_y_m) / (view.max_x_m - view.min_x_m));
  if (complaints.empty() && !(height_px >= 1 && height_px <= kMaxSide_px)) {
    complaints.add("the image would be {} pixels high, must be 1 to {}", height_px, kMaxSide_px);
  }
  complaints.positive("unit_m", unit_m, "m");
  complaints.raise("OverheadView");
  return int(height_px);
}

Result<Image> render_overhead(const std::filesystem::path& scene, double unit_m, const OverheadView& view,
                              const RenderSettings& render, const std::vector<std::filesystem::path>& scene_paths) {
  const int height_px = checked_height_px(view, unit_m);
  check(render);
  auto text = Scene::read(scene);
  if (!text) return text.error();
  const PlaceSettings place{.scene = scene, .scene_paths = scene_paths, .render = render};
  const auto povray = confined_povray(place, *text);
  if (!povray) return povray.error();

  // An orthographic camera's image is `right` wide and `up` high, centred on `location`.
  const double x = (view.min_x_m + view.max_x_m) / 2 / unit_m;
  const double y = (view.min_y_m + view.max_y_m) / 2 / unit_m;
  const std::string seen = fmt::format(
      "{}\ncamera {{ orthographic location <{},{},{}> direction <0,-1,0> right <{},0,0> up <0,0,{}> }}\n", text->text(),
      x, view.height_m / unit_m, y, (view.max_x_m - view.min_x_m) / unit_m, (view.max_y_m - view.min_y_m) / unit_m);
  const auto image = povray->render(plain_image("overhead view", seen, view.width_px, height_px, kAntialias), -1);
  if (!image) return image.error();
  return **image;
}

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
  if (!vectors) return with_name("camera " + camera->name, vectors.error());
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
    return Error(ErrorCode::kBadData, "POV-Ray answered '{}' for view {}", *answer, camera->name);
  }
  ShownCamera shown{x * place.unit_m, y * place.unit_m, {}};
  const double level = std::hypot(to_x - x, to_y - y);
  if (level > 0 && std::abs(to_up - up) < level * std::tan(kLevel_rad)) {
    shown.x_axis_rad = std::atan2(to_y - y, to_x - x);
  }
  return shown;
}

}  // namespace twocone::sim_povray

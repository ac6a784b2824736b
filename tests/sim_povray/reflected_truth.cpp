// SPDX-License-Identifier: Apache-2.0
#include "tests/sim_povray/reflected_truth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <limits>

#include <fmt/format.h>

#include "base/errors.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/scene/scene.h"
#include "drivers/sim_povray/world/motion.h"
#include "drivers/sim_povray/world/surroundings.h"

namespace twocone::sim_povray {
namespace {

constexpr double kShell_m = 1e-4;
/// Greatest brightness of a shell. It leaves room on the scale for a mirror that adds a highlight of its own.
constexpr double kGlow = 0.8;
/// The least reflection that counts: a weaker one has too few levels to encode a position.
constexpr double kLeastReflection = 0.01;
constexpr double kDeepest = 65535;

using Point = std::array<double, 3>;

/// A box around all shells. Its margin keeps the ends of the gradients, where they repeat, away from the shells.
struct Extent {
  Point least{};
  Point size{};
};

Extent extent_of(const std::vector<Landmark>& landmarks) {
  constexpr double kMargin_m = 0.01;
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Point least{kFar, kFar, 0};
  Point greatest{-kFar, -kFar, 0};
  for (const Landmark& landmark : landmarks) {
    least[0] = std::min(least[0], landmark.x_m - landmark.radius_m);
    least[1] = std::min(least[1], landmark.y_m - landmark.radius_m);
    greatest[0] = std::max(greatest[0], landmark.x_m + landmark.radius_m);
    greatest[1] = std::max(greatest[1], landmark.y_m + landmark.radius_m);
    greatest[2] = std::max(greatest[2], landmark.top_m);
  }
  Extent extent;
  for (std::size_t i = 0; i < 3; ++i) {
    extent.least[i] = least[i] - kMargin_m;
    extent.size[i] = greatest[i] - least[i] + 2 * kMargin_m;
  }
  return extent;
}

void check(const PlaceSettings& place, const TruthView& view, const std::vector<Landmark>& landmarks) {
  base::Complaints complaints;
  complaints.within("width_px", view.width_px, 1, kMaxSide_px);
  complaints.within("height_px", view.height_px, 1, kMaxSide_px);
  for (const Landmark& landmark : landmarks) {
    complaints.positive("radius_m of landmark " + landmark.name, landmark.radius_m, "m");
    complaints.positive("top_m of landmark " + landmark.name, landmark.top_m, "m");
    if (!std::isfinite(landmark.x_m) || !std::isfinite(landmark.y_m)) {
      complaints.add("landmark {} is at ({}, {}) m, must be finite", landmark.name, landmark.x_m, landmark.y_m);
    }
  }
  complaints.positive("unit_m", place.unit_m, "m");
  complaints.raise("reflected_truth");
}

/// Returns a pigment whose red, green and blue grow from 0 to 1 over the extent's x, y and z. World x, y, z is
/// POV-Ray's x, z, y.
std::string position_pigment(const Extent& extent, double unit_m) {
  constexpr std::array<const char*, 3> kAxis{"x", "z", "y"};
  // The factor of 3 compensates the average of three.
  constexpr std::array<const char*, 3> kColour{"<3,0,0>", "<0,3,0>", "<0,0,3>"};
  std::string pigment = "pigment { average pigment_map {";
  for (std::size_t i = 0; i < 3; ++i) {
    pigment += fmt::format(" [1 gradient {0} color_map {{ [0 rgb 0] [1 rgb {1}] }} scale {2} translate {3}*{0}]",
                           kAxis[i], kColour[i], extent.size[i] / unit_m, extent.least[i] / unit_m);
  }
  return pigment + " } }";
}

/// Returns the shells with a pigment, in linear light whatever gamma the scene assumes.
std::string shells(const std::vector<Landmark>& landmarks, double unit_m, const std::string& pigment) {
  std::string text = "global_settings { assumed_gamma 1.0 }\n";
  for (const Landmark& landmark : landmarks) {
    const double x = landmark.x_m / unit_m;
    const double y = landmark.y_m / unit_m;
    text += fmt::format(
        "cylinder {{ <{},0,{}>, <{},{},{}>, {} no_image no_shadow texture {{ {} finish {{ ambient 0 diffuse 0 emission "
        "{} specular 0 phong 0 crand 0 reflection 0 }} }} }}\n",
        x, y, x, (landmark.top_m + kShell_m) / unit_m, y, (landmark.radius_m + kShell_m) / unit_m, pigment, kGlow);
  }
  return text;
}

/// Returns the distance of the point from the landmark's side; < 0 inside.
double outside_m(const Landmark& landmark, const Point& point) {
  return std::hypot(point[0] - landmark.x_m, point[1] - landmark.y_m) - landmark.radius_m;
}

std::vector<TruePixel> read_off(const DeepImage& position, const DeepImage& even, const DeepImage& none,
                                const Extent& extent, const std::vector<Landmark>& landmarks, const Pose2& robot) {
  std::vector<TruePixel> pixels;
  for (int row = 0; row < even.height_px; ++row) {
    for (int column = 0; column < even.width_px; ++column) {
      const std::size_t at = (std::size_t(row) * std::size_t(even.width_px) + std::size_t(column)) * 3;
      Point point{};
      bool shown = true;
      for (std::size_t i = 0; i < 3 && shown; ++i) {
        const double full = double(even.levels[at + i]) - double(none.levels[at + i]);
        shown = full >= kLeastReflection * kGlow * kDeepest;
        if (shown) {
          const double part = (double(position.levels[at + i]) - double(none.levels[at + i])) / full;
          point[i] = extent.least[i] + part * extent.size[i];
        }
      }
      if (!shown) continue;
      const auto nearest =
          std::ranges::min_element(landmarks, {}, [&](const Landmark& landmark) { return outside_m(landmark, point); });
      pixels.push_back({column, row, std::size_t(nearest - landmarks.begin()),
                        std::hypot(point[0] - robot.x_m, point[1] - robot.y_m), point[2]});
    }
  }
  return pixels;
}

}  // namespace

Result<std::vector<TruePixel>> reflected_truth(const PlaceSettings& place, const MovedBlock& robot,
                                               const TruthView& view, const std::vector<Landmark>& landmarks,
                                               const std::vector<MovedBlock>& others) {
  check(place, view, landmarks);
  check(place.render);
  if (landmarks.empty()) return std::vector<TruePixel>{};
  const auto scene = Scene::read(place.scene);
  if (!scene) return scene.error();
  std::vector<NamedBlock> moved;
  std::vector<FloorMotion> motions;
  std::vector<MovedBlock> all = others;
  all.push_back(robot);
  for (const MovedBlock& block : all) {
    auto found = scene->object(block.object);
    if (!found) return found.error();
    moved.push_back(*std::move(found));
    motions.push_back(motion_between(block.start, block.now));
  }
  const auto camera = scene->camera(view.camera);
  if (!camera) return camera.error();
  const std::string seen =
      with_pose(scene->view_template(moved, *camera, ""), scene->pose_text(motions, motions.back(), place.unit_m));
  const auto povray = confined_povray(place, *scene);
  if (!povray) return povray.error();

  const Extent extent = extent_of(landmarks);
  // The images are rendered at the same time, each in a thread that lives until its process has ended.
  const auto render = [&](const std::string& pigment) {
    return std::async(std::launch::async, [&, text = seen + shells(landmarks, place.unit_m, pigment)] {
      return povray->render_deep(fmt::format("truth of view {}", view.camera), text, view.width_px, view.height_px);
    });
  };
  auto position = render(position_pigment(extent, place.unit_m));
  auto even = render("pigment { rgb 1 }");
  auto none = render("pigment { rgb 0 }");
  const std::array<Result<DeepImage>, 3> images{position.get(), even.get(), none.get()};
  for (const auto& image : images) {
    if (!image) return image.error();
  }
  return read_off(*images[0], *images[1], *images[2], extent, landmarks, robot.now);
}

Result<std::string> claimed_object(const PlaceSettings& place, const std::string& robot_name) {
  const auto scene = Scene::read(place.scene);
  if (!scene) return scene.error();
  auto robot = scene->robot(robot_name);
  if (!robot) return robot.error();
  return robot->name;
}

std::vector<MovedBlock> moved_blocks(const PlaceSettings& place, std::chrono::nanoseconds time) {
  std::vector<MovedBlock> blocks;
  for (const MovingThing& thing : place.moving) {
    const MovingPath path(thing);
    blocks.push_back({"moving." + thing.name, path.pose(0), path.pose(seconds(time))});
  }
  return blocks;
}

}  // namespace twocone::sim_povray

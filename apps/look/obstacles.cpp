// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "apps/config/to_layers.h"
#include "apps/look/checks.h"

namespace twocone::look {
namespace {

/// A thing of the scene that nothing of the map covers: cells that touch each other.
struct Thing {
  cv::Rect box{};  ///< of cells
  double top_m = 0;
  std::map<int, int> cells_of{};  ///< by object
};

Finding finding_of(const Thing& thing, const sim_povray::SceneGeometry& scene, const sim_povray::FloorGrid& grid,
                   double height_m, const std::string& map_file) {
  const auto most = std::ranges::max_element(thing.cells_of, {}, [](const auto& entry) { return entry.second; });
  const sim_povray::SceneObject& object = scene.objects()[std::size_t(most->first)];
  const std::string others = thing.cells_of.size() > 1 ? fmt::format(" and {} other{}", thing.cells_of.size() - 1,
                                                                     thing.cells_of.size() > 2 ? "s" : "")
                                                       : "";
  const std::string high = thing.top_m >= height_m ? fmt::format("{:.2f} m or more high", height_m)
                                                   : fmt::format("up to {:.2f} m high", thing.top_m);
  const FloorPoint low{grid.corner.x_m + kCell_m * thing.box.x, grid.corner.y_m + kCell_m * thing.box.y};
  const double wide_m = kCell_m * thing.box.width, deep_m = kCell_m * thing.box.height;
  return {
      Disagreement::kNotOnMap,
      fmt::format("{}: {}{} at x {:.2f} to {:.2f}, y {:.2f} to {:.2f}, {}: no obstacle of {} covers it", object.place(),
                  object.kind, others, low.x_m, low.x_m + wide_m, low.y_m, low.y_m + deep_m, high, map_file),
      {low.x_m + wide_m / 2, low.y_m + deep_m / 2},
      {}};
}

/// Returns the map's landmark or obstacle alone, as what may be there.
behaviours::Arena only(const config::Obstacle& obstacle) {
  constexpr double kFar_m = 1e9;
  config::Map alone;
  alone.bounds = {-kFar_m, kFar_m, -kFar_m, kFar_m};
  alone.obstacles = {obstacle};
  return config::to_arena(alone);
}

FloorPoint middle_of(const config::Obstacle& obstacle) {
  if (const auto* disc = std::get_if<Disc>(&obstacle)) return disc->centre;
  FloorPoint sum;
  const auto& corners = std::get<config::Polygon>(obstacle);
  for (const FloorPoint& corner : corners) {
    sum.x_m += corner.x_m / double(corners.size());
    sum.y_m += corner.y_m / double(corners.size());
  }
  return sum;
}

}  // namespace

void check_obstacles(const Subject& subject, const sim_povray::SceneGeometry& scene, Look& look) {
  const double height_m = subject.robot_height_m();
  const config::Bounds& bounds = subject.map.bounds;
  const sim_povray::FloorGrid grid{{bounds.min_x_m, bounds.min_y_m},
                                   kCell_m,
                                   std::max(1, int(std::ceil((bounds.max_x_m - bounds.min_x_m) / kCell_m))),
                                   std::max(1, int(std::ceil((bounds.max_y_m - bounds.min_y_m) / kCell_m)))};
  const localisation::Pose start = config::to_start_pose(subject.robot);
  std::vector<int> held(grid.size(), -1);  // the highest object of each cell; -1: none
  std::vector<double> top_m;               // of each object
  for (int object = 0; object < int(scene.objects().size()); ++object) {
    const auto box = scene.bounds(object);
    top_m.push_back(box ? box->high.z : height_m);
    if (!scene.objects()[std::size_t(object)].is_still) continue;
    const auto cells = scene.cells_of(object, grid, kLow_m, height_m, {start.x_m, start.y_m, height_m});
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (cells[i] != 0 && (held[i] < 0 || top_m[std::size_t(held[i])] < top_m.back())) held[i] = object;
    }
  }
  behaviours::Arena arena = config::to_arena(subject.map);
  // A landmark that stands elsewhere is a finding already.
  for (const Finding& finding : look.findings) {
    if (finding.in_scene) arena.discs.push_back(*finding.in_scene);
  }
  cv::Mat1b uncovered(grid.rows, grid.columns, std::uint8_t{0});
  for (std::size_t i = 0; i < grid.size(); ++i) {
    if (held[i] < 0) continue;
    const FloorPoint p = grid.centre(i);
    if (arena.clearance_m({p.x_m, p.y_m}) <= kCover_m) continue;
    uncovered.data[i] = 255;
    look.uncovered.push_back(p);
  }
  cv::Mat1i labels;
  const int count = cv::connectedComponents(uncovered, labels);
  std::vector<Thing> things(std::size_t(std::max(0, count - 1)));
  for (int i = 0; i < int(grid.size()); ++i) {
    const int row = i / grid.columns, column = i % grid.columns;
    if (labels(row, column) == 0) continue;
    Thing& thing = things[std::size_t(labels(row, column) - 1)];
    const int object = held[std::size_t(i)];
    thing.box |= cv::Rect(column, row, 1, 1);
    thing.top_m = std::max(thing.top_m, top_m[std::size_t(object)]);
    ++thing.cells_of[object];
  }
  for (const Thing& thing : things) {
    look.findings.push_back(finding_of(thing, scene, grid, height_m, subject.map.file.string()));
  }

  const auto& obstacles = subject.map.obstacles;
  const double high_m = plan_height_m(subject, &scene);
  for (std::size_t k = 0; k < obstacles.size(); ++k) {
    const behaviours::Arena obstacle = only(obstacles[k]);
    bool has_cells = false;
    bool is_there = false;
    for (std::size_t i = 0; i < grid.size() && !is_there; ++i) {
      const FloorPoint p = grid.centre(i);
      if (obstacle.clearance_m({p.x_m, p.y_m}) > 0) continue;
      has_cells = true;
      is_there = held[i] >= 0 || scene.cast({p.x_m, p.y_m, high_m}, {0, 0, -1}, high_m - kLow_m);
    }
    if (is_there || !has_cells) continue;
    const FloorPoint at = middle_of(obstacles[k]);
    look.findings.push_back(
        {Disagreement::kNotInScene,
         fmt::format(
             "{}: obstacle {} around ({:.2f}, {:.2f}): the scene has nothing there from {:.2f} to {:.2f} m over "
             "the floor",
             subject.place_of("obstacles", k), k + 1, at.x_m, at.y_m, kLow_m, high_m),
         at,
         {}});
  }
  look.checked.push_back(fmt::format(
      "{} obstacles, landmarks and walls against what is {:.2f} to {:.2f} m over the floor, in squares of {:.0f} mm",
      obstacles.size(), kLow_m, height_m, 1000 * kCell_m));
}

void check_start(const Subject& subject, Look& look) {
  const localisation::Pose start = config::to_start_pose(subject.robot);
  const Eigen::Vector2d p(start.x_m, start.y_m);
  const auto add = [&](double clear_m, const std::string& what) {
    if (clear_m >= subject.robot.body_radius_m) return;
    look.findings.push_back(
        {Disagreement::kStartTouches,
         fmt::format("{}: start ({:.3f}, {:.3f}) is {}, but body.radius_m is {}", subject.place_of_start(), start.x_m,
                     start.y_m, clear_m < 0 ? "in " + what : fmt::format("{:.3f} m from {}", clear_m, what),
                     subject.robot.body_radius_m),
         {start.x_m, start.y_m},
         {}});
  };
  config::Map walls;
  walls.bounds = subject.map.bounds;
  add(config::to_arena(walls).clearance_m(p), fmt::format("the walls, bounds_m of {}", subject.map.file.string()));
  for (std::size_t i = 0; i < subject.map.landmarks.size(); ++i) {
    const Landmark& landmark = subject.map.landmarks[i];
    add(only(Disc{{landmark.x_m, landmark.y_m}, landmark.radius_m}).clearance_m(p),
        fmt::format("landmark {} ({})", landmark.name, subject.place_of("landmarks", i)));
  }
  for (std::size_t i = 0; i < subject.map.obstacles.size(); ++i) {
    add(only(subject.map.obstacles[i]).clearance_m(p),
        fmt::format("obstacle {} ({})", i + 1, subject.place_of("obstacles", i)));
  }
  look.checked.emplace_back("the body at the start against landmarks, obstacles and walls of the map");
}

void check_floor(const Subject& subject, const sim_povray::SceneGeometry& scene, Look& look) {
  const localisation::Pose start = config::to_start_pose(subject.robot);
  const double from_m = subject.robot_height_m();
  constexpr double kDeep_m = 100;
  const auto hit = scene.cast({start.x_m, start.y_m, from_m}, {0, 0, -1}, from_m + kDeep_m);
  const auto add = [&](const std::string& text) {
    look.findings.push_back({Disagreement::kFloor, text, {start.x_m, start.y_m}, {}});
  };
  const std::string scene_file = subject.map.scene->string();
  if (!hit) return add(fmt::format("{}: there is no floor under the start ({}, {})", scene_file, start.x_m, start.y_m));
  const double floor_m = from_m - hit->distance_m;
  if (floor_m > kLow_m) return;  // what stands at the start is a finding of check_obstacles(), and hides the floor
  if (std::abs(floor_m) <= kFloor_m) {
    look.checked.push_back(fmt::format("the floor under the start, to {:.0f} mm", 1000 * kFloor_m));
    return;
  }
  const sim_povray::SceneObject& object = scene.objects()[std::size_t(hit->object)];
  add(fmt::format("{}: the floor under the start ({:.3f}, {:.3f}), a {}, is at {:.4f} m, must be at 0", object.place(),
                  start.x_m, start.y_m, object.kind, floor_m));
}

}  // namespace twocone::look

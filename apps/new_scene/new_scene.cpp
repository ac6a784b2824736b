// SPDX-License-Identifier: Apache-2.0
#include "apps/new_scene/new_scene.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <opencv2/core.hpp>

#include "apps/new_scene/parts.h"

namespace twocone::new_scene {
namespace {

/// Beyond this room around the start, more is no better.
constexpr double kEnough_m = 2.5;
constexpr std::size_t kFewest = 3;

/// Returns the start: where landmarks are in sight, then where most room is, then near the middle of the picture.
FloorPoint choose_start(const FloorGrid& grid, const SceneGeometry& geometry, const WorldFrame& frame,
                        const FloorPoint& centre, const std::vector<FoundLandmark>& landmarks,
                        const std::filesystem::path& scene) {
  constexpr int kStep = 4;  // cells
  constexpr double kLeast_m = StandardRobot::kRadius_m + 0.10;
  using Rank = std::tuple<std::size_t, double, double>;
  std::optional<std::pair<Rank, FloorPoint>> best;
  for (int row = 0; row < FloorGrid::kCells; row += kStep) {
    for (int column = 0; column < FloorGrid::kCells; column += kStep) {
      const double room_m = grid.clearance_m(row, column);
      if (room_m < kLeast_m) continue;
      const FloorPoint here = grid.middle_of(row, column);
      const auto seen = std::size_t(std::ranges::count_if(
          landmarks, [&](const FoundLandmark& found) { return sees(geometry, frame, here, found.landmark); }));
      const double away_m = std::hypot(here.x_m - centre.x_m, here.y_m - centre.y_m);
      const Rank rank{std::min(seen, kFewest), std::min(room_m, kEnough_m), -away_m};
      if (!best || rank > best->first) best.emplace(rank, here);
    }
  }
  if (!best)
    throw NoPlace("{}: the floor has no room for a robot of {} m radius", scene.string(), StandardRobot::kRadius_m);
  return best->second;
}

void add_to(Bounds& bounds, const Landmark& landmark) {
  bounds.min_x_m = std::min(bounds.min_x_m, landmark.x_m - landmark.radius_m);
  bounds.max_x_m = std::max(bounds.max_x_m, landmark.x_m + landmark.radius_m);
  bounds.min_y_m = std::min(bounds.min_y_m, landmark.y_m - landmark.radius_m);
  bounds.max_y_m = std::max(bounds.max_y_m, landmark.y_m + landmark.radius_m);
}

}  // namespace

Room find_room(const RoomSettings& settings) {
  auto read = SceneGeometry::read(settings.scene, settings.scene_paths);
  if (!read) throw NoPlace("{}", read.error().message);
  const SceneGeometry& geometry = *read;
  if (geometry.solids().empty()) throw NoPlace("{}: no shape of it was understood", settings.scene.string());

  Room room;
  room.scene = std::filesystem::absolute(settings.scene).lexically_normal();
  room.left_out = geometry.left_out();
  room.bounded = geometry.bounded();
  const Floor floor = find_floor(geometry, settings);
  room.unit_m = floor.unit_m;
  room.why_unit = floor.why_unit;
  room.floor = floor.y;
  room.floor_place = floor.place;
  const WorldFrame frame{floor.unit_m, floor.y};

  std::vector<std::size_t> solids;
  room.landmarks = scene_landmarks(geometry, frame, floor.centre, solids, room.warnings);
  const FloorGrid grid(geometry, frame, floor.centre, solids);
  const FloorPoint start = choose_start(grid, geometry, frame, floor.centre, room.landmarks, settings.scene);
  room.start = {start.x_m, start.y_m, 0};
  const cv::Mat reachable = grid.reachable_from(start);
  room.open_m2 = FloorGrid::kCell_m * FloorGrid::kCell_m * cv::countNonZero(reachable);
  room.bounds = grid.bounds_of(reachable, StandardRobot::kRadius_m);
  const auto seen = std::ranges::count_if(
      room.landmarks, [&](const FoundLandmark& found) { return sees(geometry, frame, start, found.landmark); });
  if (std::size_t(seen) < kFewest) {
    for (FoundLandmark& added : added_landmarks(geometry, frame, grid, start, room.landmarks, room.warnings)) {
      room.landmarks.push_back(std::move(added));
    }
  }
  for (const FoundLandmark& found : room.landmarks) add_to(room.bounds, found.landmark);
  room.obstacles = grid.obstacles_in(room.bounds);
  return room;
}

}  // namespace twocone::new_scene

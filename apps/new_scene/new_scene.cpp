// SPDX-License-Identifier: Apache-2.0
#include "apps/new_scene/new_scene.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>
#include <utility>

#include <opencv2/core.hpp>

#include "apps/new_scene/parts.h"

namespace twocone::new_scene {
namespace {

/// Beyond this room around the start, more is no better.
constexpr double kEnough_m = 2.5;

/// Returns places for the start, the best first: where landmarks are in sight, then where most room is, then near the
/// middle of the image.
std::vector<FloorPoint> starts(const FloorGrid& grid, const SceneGeometry& geometry, const WorldFrame& frame,
                               const FloorPoint& centre, const std::vector<FoundLandmark>& landmarks) {
  constexpr int kStep = 4;  // cells
  constexpr double kLeast_m = StandardRobot::kRadius_m + 0.10;
  using Rank = std::tuple<std::size_t, double, double>;
  std::vector<std::pair<Rank, FloorPoint>> ranked;
  for (int row = 0; row < FloorGrid::kCells; row += kStep) {
    for (int column = 0; column < FloorGrid::kCells; column += kStep) {
      const double room_m = grid.clearance_m(row, column);
      if (room_m < kLeast_m) continue;
      const FloorPoint here = grid.middle_of(row, column);
      const auto seen = std::size_t(std::ranges::count_if(
          landmarks, [&](const FoundLandmark& found) { return sees(geometry, frame, here, found.landmark); }));
      const double away_m = std::hypot(here.x_m - centre.x_m, here.y_m - centre.y_m);
      ranked.emplace_back(Rank{std::min(seen, kFewestLandmarks), std::min(room_m, kEnough_m), -away_m}, here);
    }
  }
  std::ranges::stable_sort(ranked, std::ranges::greater{}, [](const auto& item) { return item.first; });
  std::vector<FloorPoint> places;
  for (const auto& [rank, place] : ranked) places.push_back(place);
  return places;
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
  const auto places = starts(grid, geometry, frame, floor.centre, room.landmarks);
  if (places.empty()) {
    throw NoPlace("{}: the floor at y = {:.6g} has no room for a robot of {} m radius (1 unit is taken as {:.4g} m)",
                  settings.scene.string(), floor.y, StandardRobot::kRadius_m, floor.unit_m);
  }
  // The best place may have no room for landmarks.
  constexpr std::size_t kTries = 60;
  const FloorPoint* chosen = nullptr;
  std::vector<FoundLandmark> added;
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < std::min(kTries, places.size()) && chosen == nullptr; ++i) {
    const auto seen = std::size_t(std::ranges::count_if(
        room.landmarks, [&](const FoundLandmark& found) { return sees(geometry, frame, places[i], found.landmark); }));
    warnings.clear();
    if (seen < kFewestLandmarks) added = added_landmarks(geometry, frame, grid, places[i], room.landmarks, warnings);
    if (seen + added.size() >= kFewestLandmarks) chosen = &places[i];
  }
  if (chosen == nullptr) {
    throw NoPlace("{}: a robot has room, but no {} landmarks in its sight (1 unit is taken as {:.4g} m)",
                  settings.scene.string(), kFewestLandmarks, floor.unit_m);
  }
  const FloorPoint start = *chosen;
  room.start = {start.x_m, start.y_m, 0};
  std::ranges::move(added, std::back_inserter(room.landmarks));
  std::ranges::move(warnings, std::back_inserter(room.warnings));
  const cv::Mat reachable = grid.reachable_from(start);
  room.open_m2 = FloorGrid::kCell_m * FloorGrid::kCell_m * cv::countNonZero(reachable);
  room.bounds = grid.bounds_of(reachable, StandardRobot::kRadius_m);
  for (const FoundLandmark& found : room.landmarks) add_to(room.bounds, found.landmark);
  room.obstacles = grid.obstacles_in(room.bounds);
  return room;
}

}  // namespace twocone::new_scene

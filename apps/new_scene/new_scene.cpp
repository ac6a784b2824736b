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

/// Landmarks in sight, room, and nearness to the middle of the image.
using Rank = std::tuple<std::size_t, double, double>;

/// Returns how many of the landmarks the robot sees.
std::size_t seen_from(const FloorPoint& place, const SceneGeometry& geometry,
                      const std::vector<FoundLandmark>& landmarks) {
  return std::size_t(std::ranges::count_if(
      landmarks, [&](const FoundLandmark& found) { return sees(geometry, place, found.landmark); }));
}

/// Returns places for the start, the best first: where landmarks are in sight, then where most room is, then near the
/// middle of the image.
std::vector<std::pair<Rank, FloorPoint>> starts(const FloorPlan& plan, const SceneGeometry& geometry,
                                                const FloorPoint& centre, const std::vector<FoundLandmark>& landmarks) {
  constexpr std::size_t kStep = 4;  // cells
  constexpr double kLeast_m = StandardRobot::kRadius_m + 0.10;
  std::vector<std::pair<Rank, FloorPoint>> ranked;
  for (std::size_t row = 0; row < FloorPlan::kCells; row += kStep) {
    for (std::size_t column = 0; column < FloorPlan::kCells; column += kStep) {
      const FloorPoint here = plan.grid().centre(row * FloorPlan::kCells + column);
      const double room_m = plan.clearance_m(here);
      if (room_m < kLeast_m) continue;
      const double away_m = std::hypot(here.x_m - centre.x_m, here.y_m - centre.y_m);
      ranked.emplace_back(
          Rank{std::min(seen_from(here, geometry, landmarks), kFewestLandmarks), std::min(room_m, kEnough_m), -away_m},
          here);
    }
  }
  std::ranges::stable_sort(ranked, std::ranges::greater{}, [](const auto& item) { return item.first; });
  return ranked;
}

void add_to(Bounds& bounds, const Landmark& landmark) {
  bounds.min_x_m = std::min(bounds.min_x_m, landmark.x_m - landmark.radius_m);
  bounds.max_x_m = std::max(bounds.max_x_m, landmark.x_m + landmark.radius_m);
  bounds.min_y_m = std::min(bounds.min_y_m, landmark.y_m - landmark.radius_m);
  bounds.max_y_m = std::max(bounds.max_y_m, landmark.y_m + landmark.radius_m);
}

}  // namespace

Room find_room(const RoomSettings& settings) {
  Room room;
  const auto read =
      SceneGeometry::read({.scene = settings.scene, .scene_paths = settings.scene_paths, .unit_m = 1}, &room.leniency);
  if (!read) throw NoPlace("{}", read.error().message);
  if (std::ranges::none_of(read->objects(), &sim_povray::SceneObject::is_still)) {
    throw NoPlace("{}: no shape of it was understood", settings.scene.string());
  }
  room.scene = std::filesystem::absolute(settings.scene).lexically_normal();
  room.floor = find_floor(*read, settings);
  const Floor& floor = room.floor;
  const SceneGeometry geometry = read->in_frame(floor.unit_m, floor.units);

  room.landmarks = scene_landmarks(geometry, floor.centre, room.warnings);
  const FloorPlan plan(geometry, floor.centre, room.landmarks);
  const auto places = starts(plan, geometry, floor.centre, room.landmarks);
  if (places.empty()) {
    throw NoPlace("{}: the floor at y = {:.6g} has no room for a robot of {} m radius (1 unit is taken as {:.4g} m)",
                  settings.scene.string(), floor.units, StandardRobot::kRadius_m, floor.unit_m);
  }
  // The best place may have no room for landmarks.
  constexpr std::size_t kTries = 60;
  const FloorPoint* chosen = nullptr;
  std::vector<FoundLandmark> added;
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < std::min(kTries, places.size()) && chosen == nullptr; ++i) {
    const std::size_t seen = seen_from(places[i].second, geometry, room.landmarks);
    warnings.clear();
    if (seen < kFewestLandmarks) added = added_landmarks(geometry, plan, places[i].second, room.landmarks, warnings);
    if (seen + added.size() >= kFewestLandmarks) chosen = &places[i].second;
  }
  if (chosen == nullptr) {
    throw NoPlace("{}: a robot has room, but no {} landmarks in its sight (1 unit is taken as {:.4g} m)",
                  settings.scene.string(), kFewestLandmarks, floor.unit_m);
  }
  const FloorPoint start = *chosen;
  room.start = {start.x_m, start.y_m, 0};
  std::ranges::move(added, std::back_inserter(room.landmarks));
  std::ranges::move(warnings, std::back_inserter(room.warnings));
  const cv::Mat1b reachable = plan.reachable_from(start);
  room.open_m2 = FloorPlan::kCell_m * FloorPlan::kCell_m * cv::countNonZero(reachable);
  room.bounds = plan.bounds_of(reachable, StandardRobot::kRadius_m);
  for (const FoundLandmark& found : room.landmarks) add_to(room.bounds, found.landmark);
  room.obstacles = plan.obstacles_in(room.bounds);
  return room;
}

}  // namespace twocone::new_scene

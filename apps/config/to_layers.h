// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/behaviours/behaviour.h"
#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "base/shared_errors.h"
#include "drivers/backends.h"
#include "drivers/sim_povray/effects.h"
#include "localisation/odometry.h"
#include "localisation/plan_fix.h"
#include "vision/mirror_view.h"
#include "vision/ranging.h"
#include "vision/uncertain_rig.h"

/// Converts files to the settings of each layer. This is the only place that separates belief from truth. The drivers
/// receive `start:`, `body:`, `drive:`, `cameras:` and `effects:`, and from the map what a body can touch, what moves
/// and what is rendered. They receive nothing of `rig:`, and neither colour nor height of a landmark.
namespace twocone::config {

/// @throws FileError for each inconsistency: start or waypoints outside the map's bounds; landmarks of `estimator:`
/// that the map does not contain; for driver sim_povray, a robot without a start or, unless it attaches to a served
/// world, a map without a scene; `attach` without that driver; and all that drivers::check rejects
drivers::RobotSettings to_robot_settings(const Robot& robot, const Map& map, std::uint64_t seed);

/// Checks only the landmarks, for programs that open no robot.
/// @throws FileError if `estimator:` names landmarks that the map does not contain
void check_landmarks(const Robot& robot, const Map& map);

/// Returns whether the robot is simulated. If one part is simulated, all parts are (drivers::open_robot).
bool is_simulated(const Robot& robot);

/// Returns the place alone, with default render settings, for a program that serves it. Obstacles are named
/// "obstacle 1" and so on in the map's order.
/// @throws FileError for a map without a scene and for all that sim_povray::check rejects
sim_povray::PlaceSettings to_place(const Map& map);

/// Returns the views that the simulated world must render: lower, upper, then the additional cameras.
std::vector<sim_povray::ViewSettings> to_views(const drivers::RobotSettings& settings);

/// Returns the line of each key of the robot file, "effects.slip" -> "robots/lab_sim.yaml:58", and of its map, with a
/// prefix: "map.effects.shadows" -> "scenes/lab.map.yaml:53". It contains the key of a list and its entries,
/// "map.landmarks[0]", but no keys inside them. Both files are read again. @throws FileError as read_robot for files
/// that cannot be read
sim_povray::KeyPlaces key_places(const Robot& robot, const Map& map);

/// Places the upper lens so that the tips are mirror_separation_m apart. @throws FileError if MirrorView rejects a
/// view, and if the file leaves numbers to the images (Rig::missing)
vision::Rig to_rig(const Robot& robot);
/// As to_rig(), with the assumed numbers for those that the file leaves to the images: for the search of these numbers
/// alone. @throws FileError if MirrorView rejects a view
vision::Rig to_assumed_rig(const Robot& robot);

/// Returns the landmarks in the map's order. The functions below use the same order, so an index means the same
/// landmark everywhere. The greatest range is the distance from the farthest corner of the bounds.
std::vector<Landmark> to_targets(const Map& map);
/// Returns the positions of the landmarks' axes, world frame, metres.
std::vector<Eigen::Vector2d> to_landmark_positions(const Map& map);

localisation::WheelGeometry to_wheels(const Robot& robot);

/// How wrong what the robot believes may be: the effect of the shared errors on all of it, true minus believed.
struct BeliefErrors {
  vision::BeliefErrors vision;            ///< of rig and landmarks, in the map's order
  std::vector<BySharedErrors<2>> places;  ///< of the landmarks' x and y alone, m
  BySharedErrors<3> wheels;               ///< as for localisation::PoseFilter
};
/// Returns the errors that follow from the standard deviations of `rig:`, `drive:` and the map.
BeliefErrors to_belief_errors(const Robot& robot, const Map& map);

/// Returns a sentence that names what the files state no standard deviations of, so that those of a ruler count; empty
/// if there is nothing of that kind.
std::string ruler_note(const Robot& robot, const Map& map);

/// Returns the believed start pose. It is the origin of the world if the file has no start.
localisation::Pose to_start_pose(const Robot& robot);

/// Returns bounds and obstacles as walls and sides; the landmarks are not in it.
localisation::FloorPlan to_floor_plan(const Map& map);

/// Returns the bounds as walls, and landmarks and circles as discs.
behaviours::Arena to_arena(const Map& map);

}  // namespace twocone::config

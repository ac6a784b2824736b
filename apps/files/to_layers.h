// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "apps/behaviours/arena.h"
#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"
#include "drivers/backends.h"
#include "localisation/odometry.h"
#include "vision/mirror_view.h"
#include "vision/ranging.h"

/// The one place where files become the settings of each layer, and where belief and truth part: what goes to the
/// drivers comes from `start:`, `body:`, `drive:`, `cameras:` and `effects:`, and from the map what a body can touch,
/// what moves and what is rendered; nothing of `rig:`, and of a landmark neither colour nor height.
namespace twocone::files {

/// @throws FileError naming what does not go together: start or waypoints outside the map's bounds; landmarks of
/// `estimator:` that the map does not have; for driver sim_povray a robot without a start or, unless it attaches to a
/// served world, a map without a scene; attach without that driver; and what drivers::check refuses
drivers::RobotSettings to_robot_settings(const Robot& robot, const Map& map, std::uint64_t seed);

/// The landmarks alone, for who opens no robot. @throws FileError for those of `estimator:` that the map does not have
void check_landmarks(const Robot& robot, const Map& map);

/// Whether a simulation moves it: one part simulated, all are (drivers::open_robot).
bool is_simulated(const Robot& robot);

/// The place alone, with the defaults of how to render it: for who serves it. Obstacles are called "obstacle 1" and so
/// on in the map's order. @throws FileError for a map without a scene and for what sim_povray::check refuses
sim_povray::PlaceSettings to_place(const Map& map);

/// What the simulated world is asked to show: lower, upper, then the other cameras.
std::vector<sim_povray::ViewSettings> to_views(const drivers::RobotSettings& settings);

/// The upper lens stands where the tips are mirror_separation_m apart. @throws FileError for what MirrorView refuses
vision::Rig to_rig(const Robot& robot);

/// The landmarks in the map's order; likewise below, so that an index means one landmark everywhere. The greatest range
/// is that from the farthest corner of the bounds.
std::vector<vision::Target> to_targets(const Map& map);
/// Of the landmarks' axes, world frame, metres.
std::vector<Eigen::Vector2d> to_landmark_positions(const Map& map);

localisation::WheelGeometry to_wheels(const Robot& robot);
/// Where the robot believes that it starts: the world's origin if the file does not say.
localisation::Pose to_start_pose(const Robot& robot);

/// The bounds are its walls; landmarks and circles are discs.
behaviours::Arena to_arena(const Map& map);

}  // namespace twocone::files

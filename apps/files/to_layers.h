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
/// drivers comes from the scene's name and scale, `start:`, `drive:`, `cameras:` and `effects:`; nothing of `rig:`, and
/// of the map neither landmark nor obstacle.
namespace twocone::files {

/// @throws FileError naming what does not go together: start or waypoints outside the map's bounds; for driver
/// sim_povray a map without a scene or a robot without a start; and what drivers::check refuses
drivers::RobotSettings to_robot_settings(const Robot& robot, const Map& map, std::uint64_t seed);

/// The upper lens stands where the tips are mirror_separation_m apart. @throws FileError for what MirrorView refuses
vision::Rig to_rig(const Robot& robot);

/// The landmarks in the map's order; likewise below, so that an index means one landmark everywhere.
std::vector<vision::Target> to_targets(const Map& map);
/// Of the landmarks' axes, world frame, metres.
std::vector<Eigen::Vector2d> to_landmark_positions(const Map& map);

localisation::WheelGeometry to_wheels(const Robot& robot);
/// Where the robot believes that it starts: the world's origin if the file does not say.
localisation::Pose to_start_pose(const Robot& robot);

/// The bounds are its walls; landmarks and circles are discs.
behaviours::Arena to_arena(const Map& map);

}  // namespace twocone::files

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "base/plane.h"
#include "drivers/sim_povray/place.h"
#include "hal/result.h"

/// The true content of a mirror's image, pixel by pixel, for judging an answer of the vision. POV-Ray itself supplies
/// it, so it holds for every mirror that the scene has, and it shares no formula with the vision.
namespace twocone::sim_povray {

/// A named block of the scene, with the pose at which the scene shows it and its present pose: "robot", "robot.2",
/// "moving.trolley".
struct MovedBlock {
  std::string object;
  Pose2 start;
  Pose2 now;
};

/// A camera that is mounted on a robot, by its name in the scene: "lower", "lower.2".
struct TruthView {
  std::string camera;
  int width_px = 0;   ///< 1 to 16384
  int height_px = 0;  ///< 1 to 16384
};

/// A pixel that shows a landmark in the mirror.
struct TruePixel {
  int column_px = 0;
  int row_px = 0;
  std::size_t landmark = 0;  ///< index in the list that was passed
  double distance_m = 0;     ///< horizontal, from the robot's origin to the point that the pixel's centre shows
  double height_m = 0;       ///< of that point, above the floor
};

/// Returns the pixels at which `view` shows landmarks in its mirror, row by row, for the present poses of the robot and
/// the `others`. Objects that are not named stay where the scene shows them. The result contains no pixel that shows a
/// landmark directly, or in a reflection below 1 %. It contains no landmark inside another object either, such as a
/// landmark that is thinner in the map than in the scene.
///
/// Three renderings without anti-aliasing are made, in which each landmark has a shell 0.1 mm thick that only
/// reflections show. The shell glows in the colour of its position (A), evenly (B), or not at all (C). Whatever a
/// mirror does to light, (A - C) / (B - C) is the position, to 1/50000 of the landmarks' extent (0.1 mm for a room of 5
/// m).
///
/// Errors: as Simulation::open and Frame::image. @throws std::invalid_argument naming every bad argument
Result<std::vector<TruePixel>> reflected_truth(const PlaceSettings& place, const MovedBlock& robot,
                                               const TruthView& view, const std::vector<Landmark>& landmarks,
                                               const std::vector<MovedBlock>& others = {});

/// Returns the scene's name of the robot SessionSettings::name: `robot.NAME`, or `robot`. The names of its cameras have
/// the same ending. Errors: as Simulation::open.
Result<std::string> claimed_object(const PlaceSettings& place, const std::string& robot_name);

/// Returns the place's moving things at that time of the world, for `others` above.
std::vector<MovedBlock> moved_blocks(const PlaceSettings& place, std::chrono::nanoseconds time);

}  // namespace twocone::sim_povray

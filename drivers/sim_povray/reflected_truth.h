// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "drivers/sim_povray/sim_povray.h"

/// What a mirror really shows, pixel by pixel: the truth that an answer of the vision can be judged by. It comes from
/// POV-Ray itself, so it holds for every mirror that the scene has, and shares no formula with the vision.
namespace twocone::sim_povray {

/// An upright cylinder that stands on the floor of the scene. World frame.
struct TrueLandmark {
  std::string name;
  double x_m = 0, y_m = 0;  ///< of its axis
  double radius_m = 0;      ///< > 0
  double top_m = 0;         ///< > 0
};

/// A named block of the scene, with where the scene shows it and where it is now: "robot", "robot.2", "moving.trolley".
struct Stance {
  std::string object;
  Pose2 start;
  Pose2 now;
};

/// A camera that rides on a robot, by its name in the scene: "lower", "lower.2".
struct TruthView {
  std::string camera;
  int width_px = 0;   ///< 1 to 16384
  int height_px = 0;  ///< 1 to 16384
};

/// A pixel in whose mirror image a landmark stands.
struct TruePixel {
  int column_px = 0;
  int row_px = 0;
  std::size_t landmark = 0;  ///< its place in the list that was asked for
  double distance_m = 0;     ///< horizontal, from the robot's origin to the point that the pixel's centre shows
  double height_m = 0;       ///< of that point, above the floor
};

/// Where `view` shows landmarks in its mirror, row by row, for the robot and the `others` as they stand now. What is
/// not named stands as the scene shows it. Pixels at which a landmark is seen directly, or in a reflection below 1 %,
/// are not among them; nor is a landmark that stands inside another object, as one does that the map has thinner than
/// the scene.
///
/// Three renderings without anti-aliasing, in which each landmark wears a shell 0.1 mm thick that only reflections
/// show: once it glows in its position's colour (A), once evenly (B), once not at all (C). Whatever a mirror does to
/// light, (A - C) / (B - C) is the position, to 1/50000 of the landmarks' extent (0.1 mm for a room of 5 m).
///
/// Errors: as Simulation::open and Frame::image. @throws std::invalid_argument naming every bad argument
Result<std::vector<TruePixel>> reflected_truth(const PlaceSettings& place, const Stance& robot, const TruthView& view,
                                               const std::vector<TrueLandmark>& landmarks,
                                               const std::vector<Stance>& others = {});

/// What the scene calls the robot of that name (SeatSettings::name): `robot.NAME`, or `robot`. Its cameras are called
/// with the same ending. Errors: as Simulation::open.
Result<std::string> claimed_object(const PlaceSettings& place, const std::string& robot_name);

/// The place's moving things at that time of the world, for `others` above.
std::vector<Stance> moving_stances(const PlaceSettings& place, std::chrono::nanoseconds time);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "drivers/sim_povray/place.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// Position of a camera over the floor, as the scene shows it.
struct ShownCamera {
  double x_m = 0, y_m = 0;
  /// Direction of the image's x axis in the world; empty if that axis is not level within a degree.
  std::optional<double> x_axis_rad{};
};
/// Returns the position of a camera of the robot that SessionSettings::name selects. POV-Ray evaluates the camera's
/// statement without rendering an image. Ends early when stop is requested.
/// Errors: as Simulation::open; kRefused, with the reason, if the statement cannot be evaluated (the camera is of
/// another kind, takes its vectors from another camera, or its statement holds a directive).
Result<ShownCamera> shown_camera(const PlaceSettings& place, const std::string& robot_name,
                                 const std::string& camera_name, const std::stop_token& stop);

}  // namespace twocone::sim_povray

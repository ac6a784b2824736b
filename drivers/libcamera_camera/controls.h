// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "drivers/libcamera_camera/interface.h"
#include "drivers/libcamera_camera/libcamera_camera.h"

namespace twocone::libcamera_camera {

/// What a stream starts with.
struct ChosenControls {
  lc::ControlList list;
  /// Those that were asked for, in that order, within the limits that the camera tells.
  std::vector<std::pair<const lc::ControlId*, double>> applied;
  std::optional<double> rate_hz;  ///< where the camera has a control of it
};

/// Errors: kRefused, naming the controls that there are.
Result<ChosenControls> choose_controls(const lc::Camera& camera, const std::vector<Control>& wanted, double rate_hz);

/// Puts in `applied` what the camera used for a frame, where it tells.
void read_back(const lc::ControlList& metadata, ChosenControls& applied);

}  // namespace twocone::libcamera_camera

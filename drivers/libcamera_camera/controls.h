// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "drivers/libcamera_camera/interface.h"
#include "drivers/libcamera_camera/libcamera_camera.h"

namespace twocone::libcamera_camera {

/// The controls with which a stream starts.
struct ChosenControls {
  lc::ControlList list;
  /// The requested controls, in that order, within the limits that the camera reports.
  std::vector<std::pair<const lc::ControlId*, double>> applied;
  std::optional<double> rate_hz;  ///< if the camera has a control for it
};

/// Errors: kRefused, naming the existing controls.
Result<ChosenControls> choose_controls(const lc::Camera& camera, const LibcameraSettings& settings, double rate_hz);

/// Stores in `applied` the values that the camera used for a frame, if it reports them.
void read_back(const lc::ControlList& metadata, ChosenControls& applied);

}  // namespace twocone::libcamera_camera

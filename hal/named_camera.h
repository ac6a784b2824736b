// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "hal/camera.h"

namespace twocone {

/// A camera that a robot has besides its pair.
struct NamedCamera {
  std::string name;  ///< the key in the robot file's `cameras:`; neither empty nor `lower` nor `upper`
  std::unique_ptr<Camera> camera;
  CameraSettings settings;  ///< requested by Robot::start
};

/// A frame of such a camera.
struct NamedFrame {
  std::string name;
  Frame frame;
};

/// Configures and starts a camera. A camera that applies another size than the wanted one is refused, because the
/// calibration holds for one size.
/// Errors: kRefused and those of Camera::configure and Camera::start, with `name` before them.
Status start_camera(const std::string& name, Camera& camera, const CameraSettings& wanted);

/// Returns the error with the camera's name before its message: "upper: the cable is out".
Error with_name(const std::string& name, const Error& error);

}  // namespace twocone

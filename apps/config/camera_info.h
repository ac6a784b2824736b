// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/config/robot_file.h"

namespace twocone::config {

/// Reads the lens data of `view.camera_info`, a camera calibration, into `view`: a ROS camera_info YAML file, as
/// `camera_calibration` and the OpenCV tools write it. A file without coefficients, or with zeros, is of a lens without
/// distortion.
///
/// The model is plumb_bob (4 or 5 coefficients) or rational_polynomial (4, 5 or 8). Rectification, projection, binning
/// and region of interest are accepted and not used, because the mirror model replaces them. A skewed pixel grid is
/// rejected.
/// @param camera the camera to which the file must belong. @param name of that camera, for messages: "cameras.lower of
/// robots/lab.yaml"
/// @throws FileError with one line for each bad key, as read_robot
void read_camera_info(const CameraEntry& camera, const std::string& name, RigView& view);

}  // namespace twocone::config

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace twocone::config {

/// The lens data of a camera calibration: a ROS camera_info YAML file, as `camera_calibration` and the OpenCV tools
/// write it.
struct CameraInfo {
  std::array<double, 2> focal_px{};      ///< fx, fy, > 0
  std::array<double, 2> principal_px{};  ///< cx, cy; pixel (0, 0) is the centre of the first pixel
  /// k1 k2 p1 p2 [k3 [k4 k5 k6]] of OpenCV's model. Empty if the file has no coefficients or all of them are 0.
  std::vector<double> distortion;

  friend bool operator==(const CameraInfo&, const CameraInfo&) = default;
};

/// The camera to which the file must belong.
struct WantedImage {
  int width_px = 0;
  int height_px = 0;
  std::string camera;  ///< for messages: "cameras.lower of robots/lab.yaml"
};

/// Reads a file with model plumb_bob (4 or 5 coefficients) or rational_polynomial (4, 5 or 8). Rectification,
/// projection, binning and region of interest are accepted and not used, because the mirror model replaces them. A
/// skewed pixel grid is rejected.
/// @throws FileError with one line for each bad key, as read_robot
CameraInfo read_camera_info(const std::filesystem::path& file, const WantedImage& wanted);

}  // namespace twocone::config

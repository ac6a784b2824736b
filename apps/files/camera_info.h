// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace twocone::files {

/// What a camera's calibration tells of its lens: a ROS camera_info YAML file, as `camera_calibration` and OpenCV's
/// tools write it.
struct CameraInfo {
  std::array<double, 2> focal_px{};      ///< fx, fy, > 0
  std::array<double, 2> principal_px{};  ///< cx, cy; pixel (0, 0) is the first one's centre
  /// k1 k2 p1 p2 [k3 [k4 k5 k6]] of OpenCV's model; empty: none, or all of them 0.
  std::vector<double> distortion;

  friend bool operator==(const CameraInfo&, const CameraInfo&) = default;
};

/// The camera that it must be for.
struct WantedPicture {
  int width_px = 0;
  int height_px = 0;
  std::string whose;  ///< for messages: "cameras.lower of robots/lab.yaml"
};

/// Models plumb_bob (4 or 5 coefficients) and rational_polynomial (4, 5 or 8). Rectification, projection, binning and
/// region of interest may stand there and are not used: the mirror takes their place. A skewed pixel grid is refused.
/// @throws FileError with a line for each bad key, as read_robot
CameraInfo read_camera_info(const std::filesystem::path& file, const WantedPicture& wanted);

}  // namespace twocone::files

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace twocone {

/// The names, V4L2's, of the pixel formats of the drivers for real cameras, in the order in which they are tried.
constexpr std::array<std::string_view, 7> kCameraFormats{"YUYV", "UYVY", "NV12", "RGB3", "BGR3", "MJPG", "GREY"};

/// A real camera, and how it is to be used.
struct CameraDevice {
  std::string name;    ///< the name by which its driver identifies the camera
  std::string format;  ///< one of kCameraFormats; empty: the driver chooses
  /// Names and values by the driver's own naming, set in this order.
  std::vector<std::pair<std::string, double>> controls{};

  friend bool operator==(const CameraDevice&, const CameraDevice&) = default;
};

/// @throws std::invalid_argument naming every bad field, after `settings`, the settings' name in the message
void check(const CameraDevice& device, std::string_view settings);

}  // namespace twocone

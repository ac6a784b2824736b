// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "drivers/libcamera_camera/libcamera_camera.h"

namespace twocone::libcamera_camera {

/// What the module offers to the program that loads it; both are of one build.
struct Module {
  Result<std::vector<CameraInfo>> (*list_cameras)();
  /// @param settings checked
  Result<std::unique_ptr<Camera>> (*open_camera)(const LibcameraSettings& settings);
};

/// What the loader sets LIBCAMERA_LOG_LEVELS to where nobody else has: warnings and errors ("*:WARN" in figures, by
/// which the module knows that no person asked for it).
constexpr const char* kOurLogLevels = "*:2";
constexpr const char* kModuleFile = "twocone_libcamera.so";
constexpr const char* kModuleEntry = "twocone_libcamera_module";

}  // namespace twocone::libcamera_camera

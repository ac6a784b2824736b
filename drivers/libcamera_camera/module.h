// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "drivers/libcamera_camera/libcamera_camera.h"

namespace twocone::libcamera_camera {

/// The functions that the module offers to the program that loads it. Module and program must be of the same build.
struct Module {
  Result<std::vector<DeviceInfo>> (*list_cameras)();
  /// @param settings checked
  Result<std::unique_ptr<Camera>> (*open_camera)(const LibcameraSettings& settings);
};

/// The value that the loader gives LIBCAMERA_LOG_LEVELS if it is not set: warnings and errors. It is "*:WARN" written
/// with a number, so that the module can distinguish it from a user's request.
constexpr const char* kOurLogLevels = "*:2";
constexpr const char* kModuleEntry = "twocone_libcamera_module";

}  // namespace twocone::libcamera_camera

// SPDX-License-Identifier: Apache-2.0
// Replaces loader.cpp in a build without libcamera.
#include <string>

#include "drivers/libcamera_camera/libcamera_camera.h"

namespace twocone::libcamera_camera {

std::string_view why_not() { return "it was built without libcamera (Debian: libcamera-dev)"; }

Result<std::vector<DeviceInfo>> list_cameras() { return Error{ErrorCode::kUnavailable, std::string(why_not())}; }
Result<std::unique_ptr<Camera>> open_camera(const LibcameraSettings& settings) {
  check(settings);
  return Error{ErrorCode::kUnavailable, std::string(why_not())};
}

}  // namespace twocone::libcamera_camera

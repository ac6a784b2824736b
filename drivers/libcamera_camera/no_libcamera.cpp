// SPDX-License-Identifier: Apache-2.0
// Replaces loader.cpp in a build without libcamera.
#include "drivers/libcamera_camera/libcamera_camera.h"

namespace twocone::libcamera_camera {
namespace {

Error no_libcamera() { return {ErrorCode::kUnavailable, std::string(why_not())}; }

}  // namespace

std::string_view why_not() { return "it was built without libcamera (Debian: libcamera-dev)"; }

Result<std::vector<DeviceInfo>> list_cameras() { return no_libcamera(); }
Result<std::unique_ptr<Camera>> open_camera(const LibcameraSettings& settings) {
  check(settings);
  return no_libcamera();
}

}  // namespace twocone::libcamera_camera

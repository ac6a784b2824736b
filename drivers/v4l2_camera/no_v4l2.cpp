// SPDX-License-Identifier: Apache-2.0
// Replaces the driver if the kernel's headers for video devices are missing.
#include "drivers/v4l2_camera/loopback.h"
#include "drivers/v4l2_camera/v4l2_camera.h"

namespace twocone::v4l2 {

std::string_view why_not() { return "it was built without linux/videodev2.h (Debian: linux-libc-dev)"; }

std::shared_ptr<Kernel> real_kernel() { return nullptr; }
std::vector<DeviceInfo> list_cameras(const std::shared_ptr<Kernel>& /*kernel*/) { return {}; }
std::string node_of(const std::string& device, const std::shared_ptr<Kernel>& /*kernel*/) { return device; }
// NOLINTNEXTLINE(performance-unnecessary-value-param): the real driver keeps the kernel
Result<std::unique_ptr<Camera>> open_camera(const V4l2Settings& /*settings*/, std::shared_ptr<Kernel> /*kernel*/) {
  return Error{ErrorCode::kUnavailable, std::string(why_not())};
}
Result<std::unique_ptr<LoopbackDevice>> open_loopback(const std::string& device) {
  return Error(ErrorCode::kUnavailable, "{}: {}", device, why_not());
}

}  // namespace twocone::v4l2

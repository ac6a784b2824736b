// SPDX-License-Identifier: Apache-2.0
// Replaces the driver if the kernel's headers for video devices are missing.
#include "drivers/v4l2_camera/v4l2_camera.h"

namespace twocone::v4l2 {
namespace {

Error no_v4l2() { return {ErrorCode::kUnavailable, std::string(why_not())}; }

}  // namespace

std::string_view why_not() { return "it was built without linux/videodev2.h (Debian: linux-libc-dev)"; }

class V4l2Camera::Impl {};

std::shared_ptr<Kernel> real_kernel() { return nullptr; }
std::vector<CameraInfo> list_cameras(const std::shared_ptr<Kernel>& /*kernel*/) { return {}; }
std::string node_of(const std::string& device, const std::shared_ptr<Kernel>& /*kernel*/) { return device; }

V4l2Camera::V4l2Camera(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
V4l2Camera::~V4l2Camera() = default;
// NOLINTNEXTLINE(performance-unnecessary-value-param): the real driver's open() keeps the kernel
Result<std::unique_ptr<V4l2Camera>> V4l2Camera::open(const V4l2Settings&, std::shared_ptr<Kernel>) { return no_v4l2(); }
Result<CameraSettings> V4l2Camera::do_configure(const CameraSettings& /*wanted*/) { return no_v4l2(); }
Status V4l2Camera::do_start() { return no_v4l2(); }
Result<Frame> V4l2Camera::do_grab(std::chrono::milliseconds /*timeout*/) { return no_v4l2(); }
void V4l2Camera::do_stop() noexcept {}
void V4l2Camera::do_tell(CameraFacts& /*facts*/) const {}

}  // namespace twocone::v4l2

// SPDX-License-Identifier: Apache-2.0
#include "drivers/toy_camera/toy_camera.h"

#include <vector>

#include "hal/clock.h"

namespace twocone::toy_camera {

Result<CameraSettings> ToyCamera::do_configure(const CameraSettings& wanted) { return settings_ = wanted; }

Status ToyCamera::do_start() {
  next_ = 0;
  return {};
}

Result<Frame> ToyCamera::do_grab(std::chrono::milliseconds /*timeout*/) {
  const std::size_t bytes = 3 * std::size_t(settings_.width_px) * std::size_t(settings_.height_px);
  Image grey{settings_.width_px, settings_.height_px, PixelFormat::kRgb8, std::vector<std::uint8_t>(bytes, 128)};
  // The wheels of driver memory, with which it is tried, have a simulated time too.
  const std::chrono::duration<double> since_start_s(double(next_) / settings_.rate_hz);
  const Timestamp exposed{ClockKind::kSimulated, std::chrono::duration_cast<std::chrono::nanoseconds>(since_start_s)};
  return Frame({next_++, exposed, 0, 0}, std::move(grey));
}

}  // namespace twocone::toy_camera

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "drivers/libcamera_camera/libcamera_camera.h"
#include "hal/camera.h"

namespace twocone::libcamera_camera {

/// Frames are in the camera's own format, and lent where their planes lie side by side: their buffer goes back when the
/// last copy of the frame is gone. Where too few buffers are left for the camera, frames are copies instead. Capture
/// times are libcamera's (SensorTimestamp where it tells that), of the steady clock: when the frame began to come.
///
/// facts(): controls as the camera tells them with its frames, where it does, else as they were set, within the limits
/// that it tells. The rate is the nearest to the one asked for within the camera's FrameDurationLimits, where it has
/// them.
///
/// libcamera tells nothing when a camera stops sending: grab() waits no longer than ten frame periods, and at least
/// half a second, whatever it is asked for. The camera is then asked for its formats: kTimeout if it answers,
/// kDisconnected if not. After kDisconnected, configure() looks for the camera anew.
///
/// libcamera 0.0.3 ends the program when a camera that is gone is stopped. So such a stream is left as it is: its
/// buffers, and libcamera's thread that goes on looking at the device, stay until the program ends.
class LibcameraCamera final : public Camera {
 public:
  /// Errors: kNotFound, kRefused (another program has it), kUnavailable. @throws std::invalid_argument as check() does
  static Result<std::unique_ptr<LibcameraCamera>> open(const LibcameraSettings& settings);
  ~LibcameraCamera() override;

 private:
  class Impl;
  explicit LibcameraCamera(std::unique_ptr<Impl> impl);

  Result<CameraSettings> do_configure(const CameraSettings& wanted) override;
  Status do_start() override;
  Result<Frame> do_grab(std::chrono::milliseconds timeout) override;
  void do_stop() noexcept override;
  void do_tell(CameraFacts& facts) const override;

  std::unique_ptr<Impl> impl_;
};

}  // namespace twocone::libcamera_camera

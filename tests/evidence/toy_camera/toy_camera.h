// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hal/camera.h"

namespace twocone::toy_camera {

/// A camera without a device: an even grey, as often as it is grabbed.
class ToyCamera final : public Camera {
 public:
  ~ToyCamera() override { stop(); }

 private:
  Result<CameraSettings> do_configure(const CameraSettings& wanted) override;
  Status do_start() override;
  Result<Frame> do_grab(std::chrono::milliseconds timeout) override;
  void do_stop() noexcept override {}

  CameraSettings settings_;
  std::uint64_t next_ = 0;
};

}  // namespace twocone::toy_camera

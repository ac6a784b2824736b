// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <thread>

#include "drivers/memory/memory.h"
#include "hal/camera.h"

namespace twocone::testing_support {

/// A camera without a device, as memory::MemoryCamera, but in real time: a grab waits until an exposure is due, for at
/// most its timeout.
class RealTimeCamera final : public Camera {
 public:
  ~RealTimeCamera() override { stop(); }

 private:
  using Steady = std::chrono::steady_clock;

  Result<CameraSettings> do_configure(const CameraSettings& wanted) override { return settings_ = wanted; }
  Status do_start() override {
    started_ = Steady::now();
    next_ = 0;
    return {};
  }
  Result<Frame> do_grab(std::chrono::milliseconds timeout) override {
    if (time_of(next_) > Steady::now() + timeout) {
      std::this_thread::sleep_for(timeout);
      return Error{ErrorCode::kTimeout, "no exposure is due"};
    }
    std::this_thread::sleep_until(time_of(next_));
    std::uint64_t newest = next_;
    while (time_of(newest + 1) <= Steady::now()) ++newest;
    const Frame::Header header{newest, {ClockKind::kSteady, time_of(newest).time_since_epoch()}, newest - next_};
    next_ = newest + 1;
    return Frame(header, memory::test_pattern(newest, settings_));
  }
  void do_stop() noexcept override {}

  /// Computes the time from the count, because a sum of rounded periods would drift.
  [[nodiscard]] Steady::time_point time_of(std::uint64_t exposure) const {
    return started_ + std::chrono::nanoseconds(std::llround(double(exposure) * 1e9 / settings_.rate_hz));
  }

  CameraSettings settings_;
  Steady::time_point started_;
  std::uint64_t next_ = 0;  // the first exposure that is neither returned nor lost
};

}  // namespace twocone::testing_support

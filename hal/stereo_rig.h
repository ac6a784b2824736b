// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>

#include "hal/camera.h"

namespace twocone {

/// The two views of one instant.
struct StereoFrame {
  Frame lower;
  Frame upper;

  /// Time from the lower exposure to the upper one; 0 in simulation.
  [[nodiscard]] std::chrono::nanoseconds skew() const { return upper.header().captured - lower.header().captured; }
};

/// Two cameras that look at the same time.
class StereoRig {
 public:
  /// @param max_skew pairs whose exposures are farther apart than this are refused, >= 0
  /// @throws std::invalid_argument for a missing camera or a negative skew
  StereoRig(std::unique_ptr<Camera> lower, std::unique_ptr<Camera> upper, std::chrono::nanoseconds max_skew);

  /// Errors: those of Camera::configure and Camera::start, with the view's name before them.
  Status start(const CameraSettings& lower, const CameraSettings& upper);

  /// The next pair within the skew limit; a frame without a partner is dropped (and counted) in favour of a newer one.
  /// A frame that was grabbed when its partner failed is kept for the next call.
  /// Errors: those of Camera::grab, with the view's name before them; kTimeout also when no pair came together in time.
  /// @throws std::invalid_argument for a negative timeout, or for two cameras that tell the time of different clocks
  Result<StereoFrame> grab(std::chrono::milliseconds timeout);

  void stop() noexcept;

  /// Frames dropped so far because they had no partner.
  [[nodiscard]] std::uint64_t unpaired() const { return unpaired_; }

 private:
  Status grab_into(const char* view, Camera& camera, std::unique_ptr<Frame>& slot,
                   std::chrono::steady_clock::time_point deadline);

  std::unique_ptr<Camera> lower_;
  std::unique_ptr<Camera> upper_;
  std::chrono::nanoseconds max_skew_;
  std::unique_ptr<Frame> waiting_lower_;
  std::unique_ptr<Frame> waiting_upper_;
  std::uint64_t unpaired_ = 0;
};

}  // namespace twocone

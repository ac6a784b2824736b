// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>

#include "hal/camera.h"

namespace twocone {

/// The two views of one moment.
struct StereoFrame {
  Frame lower;
  Frame upper;

  /// Returns the time from the lower exposure to the upper one; 0 in simulation.
  [[nodiscard]] std::chrono::nanoseconds skew() const { return upper.header().captured - lower.header().captured; }
};

/// Two cameras that take images at the same time.
///
/// If the two cameras run freely, either may be half a period behind the other. A frame is therefore paired with the
/// nearest frame of the other camera, not with the first one within the limit.
///
/// If a camera is lost (kDisconnected), the following calls of grab() try to configure and start it again, at most four
/// times a second, until it is back. Meanwhile each call takes one frame of the other camera; these frames have no
/// partner. A camera that returns with another image size is refused, and the tries continue.
class StereoRig {
 public:
  /// A skew limit in frame periods. With it, each frame of two cameras that run freely at one rate has a partner. It is
  /// 0.1 above one half: at exactly one half, every jitter would lose a frame.
  static constexpr double kFreeSkew = 0.6;

  /// @param max_skew pairs whose exposures are farther apart than this are refused, >= 0
  /// @throws std::invalid_argument for a missing camera or a negative skew
  StereoRig(std::unique_ptr<Camera> lower, std::unique_ptr<Camera> upper, std::chrono::nanoseconds max_skew);

  /// Starts both cameras. Errors: those of Camera::configure and Camera::start, with the view's name before them.
  Status start(const CameraSettings& lower, const CameraSettings& upper);

  /// Returns the next pair within the skew limit. A frame without a partner is dropped (and counted) in favour of a
  /// newer one. If one camera fails, the other camera's frame is kept for the next call.
  /// Errors: those of Camera::grab, with the view's name before them; those of its start while a camera is lost;
  /// kTimeout also if no pair was found in time.
  /// @throws std::invalid_argument for a negative timeout, or for two cameras whose timestamps have different clocks
  Result<StereoFrame> grab(std::chrono::milliseconds timeout);

  void stop() noexcept;

  [[nodiscard]] const Camera& lower() const { return *lower_.camera; }
  [[nodiscard]] const Camera& upper() const { return *upper_.camera; }
  /// Returns the number of frames dropped so far because they had no partner.
  [[nodiscard]] std::uint64_t unpaired() const { return unpaired_; }
  /// Returns the number of times that a lost camera was started again.
  [[nodiscard]] std::uint64_t recoveries() const { return recoveries_; }

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  struct Eye {
    const char* view;
    std::unique_ptr<Camera> camera;
    CameraSettings settings{};
    std::unique_ptr<Frame> waiting{};
    std::unique_ptr<Frame> next{};  ///< the frame after `waiting`, if it has arrived
    std::chrono::nanoseconds period{};
    bool is_lost = false;
    SteadyTime next_try{};
  };

  Status start(Eye& eye);
  void lose(Eye& eye);
  Status fill(Eye& eye, Eye& other, SteadyTime deadline);
  Status look_for(Eye& eye, Eye& other, SteadyTime deadline);
  void let_pass(Eye& eye, SteadyTime until);
  Status find_nearer(SteadyTime deadline);
  [[nodiscard]] std::chrono::nanoseconds waiting_skew() const;
  void drop(std::unique_ptr<Frame>& frame);

  Eye lower_;
  Eye upper_;
  std::chrono::nanoseconds max_skew_;
  std::uint64_t unpaired_ = 0;
  std::uint64_t recoveries_ = 0;
};

}  // namespace twocone

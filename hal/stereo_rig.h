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
///
/// Of two that run free, either may be half a period behind the other: a frame is paired with the nearest of the
/// other's, not with the first that the limit allows.
///
/// A camera that goes away (kDisconnected) is looked for by the calls of grab() that follow: it is configured and
/// started again, at most four times a second, until it is back. The other one goes on meanwhile, a frame a call; these
/// find no partner. One that comes back with another size of picture is refused, and looked for on.
class StereoRig {
 public:
  /// In frame periods: a skew limit with which each frame of two cameras that run freely, at one rate, has a partner. A
  /// tenth more than the half: at the very half, each jitter would cost a frame.
  static constexpr double kFreeSkew = 0.6;

  /// @param max_skew pairs whose exposures are farther apart than this are refused, >= 0
  /// @throws std::invalid_argument for a missing camera or a negative skew
  StereoRig(std::unique_ptr<Camera> lower, std::unique_ptr<Camera> upper, std::chrono::nanoseconds max_skew);

  /// Errors: those of Camera::configure and Camera::start, with the view's name before them.
  Status start(const CameraSettings& lower, const CameraSettings& upper);

  /// The next pair within the skew limit; a frame without a partner is dropped (and counted) in favour of a newer one.
  /// A frame that was grabbed when its partner failed is kept for the next call.
  /// Errors: those of Camera::grab, with the view's name before them, and while a camera is looked for those of its
  /// start; kTimeout also when no pair came together in time.
  /// @throws std::invalid_argument for a negative timeout, or for two cameras that tell the time of different clocks
  Result<StereoFrame> grab(std::chrono::milliseconds timeout);

  void stop() noexcept;

  [[nodiscard]] const Camera& lower() const { return *lower_.camera; }
  [[nodiscard]] const Camera& upper() const { return *upper_.camera; }
  [[nodiscard]] std::chrono::nanoseconds max_skew() const { return max_skew_; }
  /// Frames dropped so far because they had no partner.
  [[nodiscard]] std::uint64_t unpaired() const { return unpaired_; }
  /// How often a camera was found again.
  [[nodiscard]] std::uint64_t recoveries() const { return recoveries_; }

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  struct Eye {
    const char* view;
    std::unique_ptr<Camera> camera;
    CameraSettings settings{};
    std::unique_ptr<Frame> waiting{};
    std::unique_ptr<Frame> next{};  ///< the one after it, if that came already
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

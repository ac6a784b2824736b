// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "hal/camera.h"
#include "hal/clock.h"

namespace twocone::memory {

/// Makes the picture of exposure number `sequence`. It is handed on as it is, also where it is not what the settings
/// promise: a consumer must find that out.
using Picture = std::function<Image(std::uint64_t sequence, const CameraSettings& settings)>;

/// The mark of the test pattern has this many places round the picture.
inline constexpr int kMarkPlaces = 60;

/// A colour wheel: the hue is the azimuth atan2(row - centre, column - centre) about the picture's centre, at full
/// saturation. One ray of it is white, the mark: it stands at azimuth 2 pi (sequence mod kMarkPlaces) / kMarkPlaces,
/// like the hand of a watch, so that a picture tells which exposure it is. kRgb8.
Image test_pattern(std::uint64_t sequence, const CameraSettings& settings);

/// The place, 0 .. kMarkPlaces - 1, of the mark in a test pattern; nothing where no pixel is white. Pictures of 48 rows
/// and more tell all places apart (memory_camera_test.cpp, MarkTellsTheSequence).
std::optional<int> mark_place(const Image& image);

/// What a grab does on a clock that only moves when told, if no exposure is due that has not been handed out.
enum class WhenNotDue {
  kAdvance,  ///< moves the clock to the next exposure and hands that out: cameras grabbed in turn run in lock-step
  kTimeOut,  ///< kTimeout at once: the test that owns the clock decides when exposures happen
};

/// What MemoryCamera::configure adjusts to. The rates keep exposure times exact in whole nanoseconds for years.
inline constexpr int kLargestSide_px = 8192;
inline constexpr double kSlowest_hz = 0.001;
inline constexpr double kFastest_hz = 1000;

/// A camera without a device. Exposure k happens k / rate_hz after start() on the given clock, the first one at once;
/// start() begins again with 0. A grab hands out the newest exposure and tells how many before it were lost.
class MemoryCamera final : public Camera {
 public:
  /// In real time: a grab sleeps until an exposure is due, at most its timeout.
  explicit MemoryCamera(std::shared_ptr<const SteadyClock> clock, Picture picture = test_pattern);

  /// In the time of a clock that several devices share (why it is a shared_ptr). No call ever waits, so that timeouts
  /// are always kept.
  MemoryCamera(std::shared_ptr<ManualClock> clock, WhenNotDue when_not_due, Picture picture = test_pattern);

  ~MemoryCamera() override;

 private:
  Result<CameraSettings> do_configure(const CameraSettings& wanted) override;
  Status do_start() override;
  Result<Frame> do_grab(std::chrono::milliseconds timeout) override;
  void do_stop() noexcept override;

  [[nodiscard]] std::chrono::nanoseconds since_start(std::uint64_t sequence) const;
  /// How many exposures have happened so far in this stream.
  [[nodiscard]] std::uint64_t exposed() const;
  Status wait_for_next(std::chrono::milliseconds timeout);

  std::shared_ptr<const Clock> clock_;
  std::shared_ptr<ManualClock> manual_;  ///< the same clock, if it can be advanced
  WhenNotDue when_not_due_ = WhenNotDue::kTimeOut;
  Picture picture_;
  CameraSettings settings_;
  Timestamp started_;
  std::uint64_t next_ = 0;  ///< the first exposure not handed out nor lost
};

}  // namespace twocone::memory

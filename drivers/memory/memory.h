// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "hal/camera.h"
#include "hal/clock.h"
#include "hal/diff_drive.h"

namespace twocone::memory {

/// The number of places that the mark of the test pattern can have around the image.
inline constexpr int kMarkPlaces = 60;

/// Returns a colour wheel: the hue is the azimuth atan2(row - centre, column - centre) about the image's centre, at
/// full saturation. One ray, the mark, is white. Its azimuth is 2 pi (sequence mod kMarkPlaces) / kMarkPlaces, like the
/// hand of a watch, so that an image shows the number of its exposure. With 48 rows or more, all places are
/// distinguishable (memory_test.cpp, MarkIdentifiesTheSequence). The format is kRgb8.
Image test_pattern(std::uint64_t sequence, const CameraSettings& settings);

/// Limits that MemoryCamera::configure applies. With these rates, the times of exposures are exact in whole nanoseconds
/// for years.
inline constexpr int kLargestSide_px = 8192;
inline constexpr double kSlowest_hz = 0.001;
inline constexpr double kFastest_hz = 1000;

/// A camera without a device, which shows the test pattern. Exposure k happens k / rate_hz after start() on the given
/// clock, exposure 0 at once. A new start() begins again with 0. A grab returns the newest exposure and the number of
/// lost ones before it. If no new exposure is due, it advances the clock to the next one: cameras on one clock that are
/// grabbed in turn run in lock-step. No call ever waits, so timeouts are always kept.
class MemoryCamera final : public Camera {
 public:
  /// @param clock may be shared with other devices @throws std::invalid_argument for a missing clock
  explicit MemoryCamera(std::shared_ptr<ManualClock> clock);
  ~MemoryCamera() override { stop(); }

 private:
  Result<CameraSettings> do_configure(const CameraSettings& wanted) override;
  Status do_start() override;
  Result<Frame> do_grab(std::chrono::milliseconds timeout) override;
  void do_stop() noexcept override {}

  [[nodiscard]] std::chrono::nanoseconds since_start(std::uint64_t sequence) const;
  /// Returns the number of exposures so far in this stream.
  [[nodiscard]] std::uint64_t exposed() const;

  std::shared_ptr<ManualClock> clock_;
  CameraSettings settings_;
  Timestamp started_;
  std::uint64_t next_ = 0;  ///< the first exposure that is neither returned nor lost
};

/// Two ideal wheels and their controller. They reach a commanded speed at once and keep the dead-man rule by
/// themselves, as a motor controller does. They outlive the drive, so that a test can see them stop.
class Wheels {
 public:
  struct Command {
    Timestamp time;
    WheelSpeeds speeds;  ///< 0 and 0 for a stop
  };

  /// @param command_timeout dead-man time, > 0, which the drive's limits have checked
  /// @throws std::invalid_argument for a missing clock
  Wheels(std::shared_ptr<const Clock> clock, std::chrono::nanoseconds command_timeout);

  void command(const WheelSpeeds& speeds);

  /// Returns the present speeds: 0 and 0 from exactly command_timeout after the last command.
  [[nodiscard]] WheelSpeeds speeds() const;

  /// Returns the integral of speeds() so far, not rounded to encoder counts.
  [[nodiscard]] WheelAngles angles() const;

  /// Returns all commands that the wheels received, oldest first.
  [[nodiscard]] const std::vector<Command>& commands() const { return commands_; }

 private:
  std::shared_ptr<const Clock> clock_;
  std::chrono::nanoseconds command_timeout_;
  std::vector<Command> commands_;
  WheelAngles at_last_command_;
};

/// A drive without a device, on the given clock. No call ever fails.
class MemoryDiffDrive final : public DiffDrive {
 public:
  /// @throws std::invalid_argument for a missing clock and as check(limits) does
  MemoryDiffDrive(std::shared_ptr<const Clock> clock, const DriveLimits& limits)
      : DiffDrive(limits), wheels_(std::make_shared<Wheels>(std::move(clock), limits.command_timeout)) {}
  ~MemoryDiffDrive() override { wheels_->command({}); }

  [[nodiscard]] std::shared_ptr<const Wheels> wheels() const { return wheels_; }

 private:
  Status do_set_speeds(const WheelSpeeds& speeds) override {
    wheels_->command(speeds);
    return {};
  }
  Result<WheelAngles> do_read_angles() override { return wheels_->angles(); }
  Status do_stop() noexcept override {
    wheels_->command({});
    return {};
  }

  std::shared_ptr<Wheels> wheels_;
};

}  // namespace twocone::memory

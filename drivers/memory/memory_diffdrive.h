// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <vector>

#include "hal/clock.h"
#include "hal/diff_drive.h"

namespace twocone::memory {

/// Two ideal wheels and their controller. They reach a commanded speed at once and keep the dead-man rule by
/// themselves, as a motor controller does. They outlive the drive, so that a test can see them stop.
class Wheels {
 public:
  struct Command {
    Timestamp time;
    WheelSpeeds speeds;  ///< 0 and 0 for a stop
  };

  /// @param command_timeout dead-man time, > 0
  /// @throws std::invalid_argument for a missing clock or a time that is not positive
  Wheels(std::shared_ptr<const Clock> clock, std::chrono::nanoseconds command_timeout);

  void command(const WheelSpeeds& speeds);

  /// The present speeds: 0 and 0 from exactly command_timeout after the last command.
  [[nodiscard]] WheelSpeeds speeds() const;

  /// The integral of speeds() so far, not rounded to encoder counts.
  [[nodiscard]] WheelAngles angles() const;

  /// All commands that they received, oldest first.
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
  MemoryDiffDrive(std::shared_ptr<const Clock> clock, const DriveLimits& limits);
  ~MemoryDiffDrive() override;

  [[nodiscard]] std::shared_ptr<const Wheels> wheels() const { return wheels_; }

 private:
  Status do_set_speeds(const WheelSpeeds& speeds) override;
  Result<WheelAngles> do_read_angles() override;
  Status do_stop() noexcept override;

  std::shared_ptr<Wheels> wheels_;
};

}  // namespace twocone::memory

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "hal/diff_drive.h"
#include "tests/support/random_draws.h"

namespace twocone::testing_support {

/// Faults of a motor controller on a bad cable. Probabilities are per call, in [0, 1], and independent; 0: never,
/// 1: always.
struct DriveFaults {
  double command_lost_chance = 0;  ///< set_speeds or stop: kTimeout, and the wheels never get the command
  double reply_lost_chance = 0;    ///< set_speeds or stop: kTimeout, although the wheels obey
  double read_timeout_chance = 0;  ///< read_angles: kTimeout
  double bad_data_chance = 0;      ///< read_angles: kBadData, as when a checksum finds the error
  double misread_chance = 0;       ///< read_angles: each angle is wrong by up to misread_rad, as without a checksum
  double misread_rad = 1;          ///< >= 0
  /// The number of calls after which the cable comes off permanently: kDisconnected, and nothing reaches the wheels.
  std::optional<std::uint64_t> disconnect_after;
};

/// Checks the faults. @throws std::invalid_argument naming every field outside its domain
void check(const DriveFaults& faults);

/// Any drive behind an emulated bad cable. The same seed and calls give the same faults. While the cable is off, only
/// the drive's own dead-man rule can stop the wheels.
class FaultyDiffDrive final : public DiffDrive {
 public:
  /// @throws std::invalid_argument for a missing drive and as check() does
  FaultyDiffDrive(std::unique_ptr<DiffDrive> drive, const DriveFaults& faults, std::uint64_t seed);
  /// Destroys the drive behind the cable too, which then stops its wheels, even if the cable is off.
  ~FaultyDiffDrive() override = default;

 private:
  Status do_set_speeds(const WheelSpeeds& speeds) override;
  Result<WheelAngles> do_read_angles() override;
  Status do_stop() noexcept override;

  /// Counts the call and reports whether the cable is still connected.
  Status pass_cable();
  template <typename Call>
  Status command(Call call);

  std::unique_ptr<DiffDrive> drive_;
  DriveFaults faults_;
  RandomDraws random_;
  std::uint64_t calls_ = 0;
};

}  // namespace twocone::testing_support

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "drivers/memory/dice.h"
#include "hal/diff_drive.h"

namespace twocone::memory {

/// What goes wrong with a motor controller on a bad cable. Chances are per call, in [0, 1], and independent; 0 never,
/// 1 always.
struct DriveFaults {
  double command_lost_chance = 0;  ///< set_speeds or stop: kTimeout, and the wheels never heard of it
  double reply_lost_chance = 0;    ///< set_speeds or stop: kTimeout, although the wheels obey
  double read_timeout_chance = 0;  ///< read_angles: kTimeout
  double bad_data_chance = 0;      ///< read_angles: kBadData, as where a checksum catches what the cable did
  double misread_chance = 0;       ///< read_angles: each angle wrong by up to misread_rad, as where nothing catches it
  double misread_rad = 1;          ///< >= 0
  /// So many calls after opening the cable comes off, for good: kDisconnected, and nothing reaches the wheels any more.
  std::optional<std::uint64_t> disconnect_after;
};

/// @throws std::invalid_argument naming every field outside its domain
void check(const DriveFaults& faults);

/// Any drive, behind a bad cable. The same seed and calls give the same faults. While the cable is off, only the
/// drive's own dead-man rule can stop the wheels.
class FaultyDiffDrive final : public DiffDrive {
 public:
  /// @throws std::invalid_argument for a missing drive and as check() does
  FaultyDiffDrive(std::unique_ptr<DiffDrive> drive, const DriveFaults& faults, std::uint64_t seed);
  /// The drive behind the cable stops its wheels when it is destroyed in turn, cable or no cable.
  ~FaultyDiffDrive() override = default;

 private:
  Status do_set_speeds(const WheelSpeeds& speeds) override;
  Result<WheelAngles> do_read_angles() override;
  Status do_stop() noexcept override;

  /// Counts the call, and tells whether the cable is still on.
  Status pass_cable();
  template <typename Call>
  Status command(Call call);

  std::unique_ptr<DiffDrive> drive_;
  DriveFaults faults_;
  Dice dice_;
  std::uint64_t calls_ = 0;
};

}  // namespace twocone::memory

// SPDX-License-Identifier: Apache-2.0
#include "drivers/memory/memory_diffdrive.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

namespace twocone::memory {

Wheels::Wheels(std::shared_ptr<const Clock> clock, std::chrono::nanoseconds command_timeout)
    : clock_(std::move(clock)), command_timeout_(command_timeout) {
  if (!clock_) throw std::invalid_argument("Wheels: needs a clock");
  if (command_timeout.count() <= 0) {
    throw std::invalid_argument(fmt::format("Wheels: command_timeout is {} ns, must be > 0", command_timeout.count()));
  }
}

void Wheels::command(const WheelSpeeds& speeds) {
  at_last_command_ = angles();
  commands_.push_back({at_last_command_.time, speeds});
}

WheelSpeeds Wheels::speeds() const {
  if (commands_.empty() || clock_->now() - commands_.back().time >= command_timeout_) return {};
  return commands_.back().speeds;
}

WheelAngles Wheels::angles() const {
  WheelAngles angles = at_last_command_;
  angles.time = clock_->now();
  if (commands_.empty()) return angles;
  const Command& last = commands_.back();
  const std::chrono::duration<double> turning = std::min(angles.time - last.time, command_timeout_);
  angles.left_rad += last.speeds.left_radps * turning.count();
  angles.right_rad += last.speeds.right_radps * turning.count();
  return angles;
}

MemoryDiffDrive::MemoryDiffDrive(std::shared_ptr<const Clock> clock, const DriveLimits& limits)
    : DiffDrive(limits), wheels_(std::make_shared<Wheels>(std::move(clock), limits.command_timeout)) {}

MemoryDiffDrive::~MemoryDiffDrive() { wheels_->command({}); }

Status MemoryDiffDrive::do_set_speeds(const WheelSpeeds& speeds) {
  wheels_->command(speeds);
  return {};
}

Result<WheelAngles> MemoryDiffDrive::do_read_angles() { return wheels_->angles(); }

Status MemoryDiffDrive::do_stop() noexcept {
  wheels_->command({});
  return {};
}

}  // namespace twocone::memory

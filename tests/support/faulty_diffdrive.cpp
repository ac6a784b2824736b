// SPDX-License-Identifier: Apache-2.0
#include "tests/support/faulty_diffdrive.h"

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace twocone::testing_support {
namespace {

const DriveLimits& limits_of(const std::unique_ptr<DiffDrive>& drive) {
  if (!drive) throw std::invalid_argument("FaultyDiffDrive: needs a drive");
  return drive->limits();
}

}  // namespace

void check(const DriveFaults& faults) {
  std::string bad = complaint("command_lost_chance", faults.command_lost_chance) +
                    complaint("reply_lost_chance", faults.reply_lost_chance) +
                    complaint("read_timeout_chance", faults.read_timeout_chance) +
                    complaint("bad_data_chance", faults.bad_data_chance) +
                    complaint("misread_chance", faults.misread_chance);
  if (!(faults.misread_rad >= 0) || !std::isfinite(faults.misread_rad)) {
    bad += fmt::format(" misread_rad is {} rad, must be >= 0 and finite;", faults.misread_rad);
  }
  if (!bad.empty()) throw std::invalid_argument("DriveFaults:" + bad);
}

FaultyDiffDrive::FaultyDiffDrive(std::unique_ptr<DiffDrive> drive, const DriveFaults& faults, std::uint64_t seed)
    : DiffDrive(limits_of(drive)), drive_(std::move(drive)), faults_(faults), random_(seed) {
  check(faults);
}

Status FaultyDiffDrive::pass_cable() {
  if (faults_.disconnect_after && calls_ >= *faults_.disconnect_after) {
    return Error(ErrorCode::kDisconnected, "the cable came off after {} calls", *faults_.disconnect_after);
  }
  ++calls_;
  return {};
}

template <typename Call>
Status FaultyDiffDrive::command(Call call) {
  if (auto passed = pass_cable(); !passed) return passed;
  // Every call draws both: see RandomDraws::happens.
  const bool command_lost = random_.happens(faults_.command_lost_chance);
  const bool reply_lost = random_.happens(faults_.reply_lost_chance);
  if (command_lost) return Error{ErrorCode::kTimeout, "no reply to the command: the bad cable lost the command"};
  Status done = call();
  if (reply_lost) return Error{ErrorCode::kTimeout, "no reply to the command: the bad cable lost the reply"};
  return done;
}

Status FaultyDiffDrive::do_set_speeds(const WheelSpeeds& speeds) {
  return command([&]() -> Status {
    const auto applied = drive_->set_speeds(speeds);
    return applied ? Status() : Status(applied.error());
  });
}

Status FaultyDiffDrive::do_stop() noexcept {
  return command([&] { return drive_->stop(); });
}

Result<WheelAngles> FaultyDiffDrive::do_read_angles() {
  if (auto passed = pass_cable(); !passed) return passed.error();
  const bool times_out = random_.happens(faults_.read_timeout_chance);
  const bool bad_data = random_.happens(faults_.bad_data_chance);
  const bool misread = random_.happens(faults_.misread_chance);
  const double left_error_rad = faults_.misread_rad * random_.between(-1, 1);
  const double right_error_rad = faults_.misread_rad * random_.between(-1, 1);
  if (times_out) return Error{ErrorCode::kTimeout, "the bad cable let no reading through"};
  auto angles = drive_->read_angles();
  if (!angles) return angles;
  if (bad_data) return Error{ErrorCode::kBadData, "the bytes that came over the bad cable are not a reading"};
  if (misread) {
    angles->left_rad += left_error_rad;
    angles->right_rad += right_error_rad;
  }
  return angles;
}

}  // namespace twocone::testing_support

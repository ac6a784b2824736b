// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "apps/doctor/surroundings.h"
#include "hal/diff_drive.h"

namespace twocone::doctor {

/// The name of the wheels in the rows of the report.
inline constexpr const char* kDrivePart = "drive";

struct WheelSample {
  double t_s = 0;  ///< the doctor's clock
  double left_rad = 0;
  double right_rad = 0;
};

/// The samples of commanded wheels, oldest first.
struct Course {
  std::vector<WheelSample> samples;
  double last_command_s = 0;   ///< time of the last command
  bool ran_away = false;       ///< they were stopped because they turned backward or too fast
  std::optional<Error> error;  ///< they were stopped because the drive did not answer

  [[nodiscard]] bool is_whole() const { return !ran_away && !error && samples.size() > 2; }
};

/// Returns the angle below which a difference may belong to a wheel that stands still: two counts. @param
/// counts_per_turn 0: unknown
double still_rad(double counts_per_turn);

/// Turns wheels that are off the ground. Whatever ends it, a return or an exception, the wheels are stopped.
class WheelBench {
 public:
  WheelBench(DiffDrive& drive, double counts_per_turn, const Surroundings& surroundings);
  ~WheelBench() { static_cast<void>(drive_.stop()); }
  WheelBench(const WheelBench&) = delete;
  WheelBench& operator=(const WheelBench&) = delete;

  /// A speed that a user can follow with the eye: at most one turn per second, and well below the drive's limit.
  [[nodiscard]] double speed_radps() const { return speed_radps_; }
  [[nodiscard]] double still_rad() const { return still_rad_; }

  /// Commands the speeds repeatedly for `seconds`, or until `is_far_enough`, and reads the angles. Afterwards the
  /// wheels continue with the last command. @throws Interrupted
  Course drive(const WheelSpeeds& speeds, double seconds, const std::string& what,
               const std::function<bool(const WheelSample&)>& is_far_enough = {});

  Result<WheelSample> read();
  /// Reads until the wheels have not moved for a short time, at most `seconds`; returns the samples.
  Course watch(double seconds);
  /// Stops the wheels and waits until they stand still, at most two seconds.
  void halt();
  /// Waits without commands and readings. @throws Interrupted
  void wait(double seconds);

 private:
  [[nodiscard]] bool is_out_of_hand(const Course& course, const WheelSpeeds& speeds) const;

  DiffDrive& drive_;
  const Surroundings& surroundings_;
  double speed_radps_;
  double still_rad_;
};

}  // namespace twocone::doctor

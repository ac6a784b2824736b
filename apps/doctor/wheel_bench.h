// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "apps/doctor/surroundings.h"
#include "hal/diff_drive.h"

namespace twocone::doctor {

struct WheelSample {
  double t_s = 0;  ///< the doctor's clock
  double left_rad = 0;
  double right_rad = 0;
};

/// What wheels did that were told to turn, oldest first.
struct Course {
  std::vector<WheelSample> samples;
  double last_command_s = 0;   ///< when the last command was given
  bool ran_away = false;       ///< they were stopped since they turned backward or too fast
  std::optional<Error> error;  ///< they were stopped since the drive did not answer

  [[nodiscard]] bool is_whole() const { return !ran_away && !error && samples.size() > 2; }
};

/// Angles that differ by no more may be of a wheel at rest: two counts. @param counts_per_turn 0: not known
double still_rad(double counts_per_turn);

/// Turns wheels that hang free. Whatever ends it, a return or an exception, the wheels are told to stop.
class WheelBench {
 public:
  WheelBench(DiffDrive& drive, double counts_per_turn, const Surroundings& surroundings);
  ~WheelBench() { static_cast<void>(drive_.stop()); }
  WheelBench(const WheelBench&) = delete;
  WheelBench& operator=(const WheelBench&) = delete;

  /// A speed at which a person can follow a wheel: no more than a turn a second, and well below the drive's limit.
  [[nodiscard]] double speed_radps() const { return speed_radps_; }
  [[nodiscard]] double still_rad() const { return still_rad_; }

  /// Commands the speeds again and again for `seconds`, or until `is_far_enough`, and reads the angles; the wheels turn
  /// on afterwards, as by the last command. @throws Interrupted
  Course drive(const WheelSpeeds& speeds, double seconds, const std::string& what,
               const std::function<bool(const WheelSample&)>& is_far_enough = {});

  Result<WheelSample> read();
  /// Reads until the wheels have not moved for a moment, at most `seconds`; the samples.
  Course watch(double seconds);
  /// Stops the wheels and waits until they rest, at most two seconds.
  void rest();
  /// Neither commands nor reads. @throws Interrupted
  void wait(double seconds);

 private:
  [[nodiscard]] bool is_out_of_hand(const Course& course, const WheelSpeeds& speeds) const;

  DiffDrive& drive_;
  const Surroundings& surroundings_;
  double speed_radps_;
  double still_rad_;
};

}  // namespace twocone::doctor

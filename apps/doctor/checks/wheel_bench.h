// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/doctor/checks/checks.h"
#include "hal/diff_drive.h"

namespace twocone::doctor {

/// The name of the wheels in the rows of the report.
inline constexpr const char* kDrivePart = "drive";

struct WheelSample {
  double t_s = 0;  ///< time of the reading on the doctor's clock
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

/// Returns the largest difference of angle that a wheel which stands still may show: two counts, with rounding.
/// @param counts_per_turn 0: unknown
double still_rad(double counts_per_turn);

/// Turns wheels that are off the ground. The destructor stops the wheels, also after an exception.
class WheelBench {
 public:
  WheelBench(DiffDrive& drive, double counts_per_turn, const Surroundings& surroundings);
  ~WheelBench() { static_cast<void>(drive_.stop()); }
  WheelBench(const WheelBench&) = delete;
  WheelBench& operator=(const WheelBench&) = delete;

  /// Returns a speed that a user can follow by eye: at most one turn per second, and well below the drive's limit.
  [[nodiscard]] double speed_radps() const { return speed_radps_; }
  [[nodiscard]] double still_rad() const { return still_rad_; }

  /// Commands the speeds repeatedly for `seconds`, or until `is_far_enough`, and reads the angles. Afterwards the
  /// wheels continue with the last command, unless they ran away or the drive failed. @throws Interrupted
  Course drive(const WheelSpeeds& speeds, double seconds, const std::string& what,
               const std::function<bool(const WheelSample&)>& is_far_enough = {});

  Result<WheelSample> read();
  /// Reads until the wheels have not moved for a short time, at most for `seconds`. Returns the samples.
  Course watch(double seconds);
  /// Stops the wheels and waits until they stand still, at most two seconds.
  void halt();
  /// Waits without commands or readings. @throws Interrupted
  void wait(double seconds);

 private:
  [[nodiscard]] bool is_out_of_hand(const Course& course, const WheelSpeeds& speeds) const;

  DiffDrive& drive_;
  const Surroundings& surroundings_;
  double speed_radps_;
  double still_rad_;
};

// ---- which wheel turns in which direction, how fast, and how far

enum class Side { kLeft, kRight };
std::string_view to_string(Side side);

/// The motion of one wheel.
struct Turning {
  Side side = Side::kLeft;
  bool is_forward = true;

  friend bool operator==(const Turning&, const Turning&) = default;
};

/// Parses "lf", "left forward", "right back" and the like. Returns nothing if the text lacks the wheel or direction.
std::optional<Turning> parse_turning(std::string_view text);

/// The angles that the encoders reported while one wheel was commanded forward.
struct Counted {
  double left_rad = 0;
  double right_rad = 0;
  double commanded_rad = 0;  ///< > 0

  /// Returns the only wheel that moved, or nothing if both or neither moved.
  [[nodiscard]] std::optional<Turning> turning() const;
  [[nodiscard]] bool has_nothing() const;
};

/// Finds reversed or exchanged connections. The file's swap_wheels and reverse_... exchange motors and encoders
/// together. They are the remedy if encoder and command agree, but the user saw another wheel or another direction. If
/// encoder and command do not agree, no key helps, and a plug must be changed.
/// @param commanded the wheel that was commanded forward. @param seen the motion that the user reported, if any
/// @param settings those of the robot file, if any
Row judge_turning(Side commanded, const Counted& counted, const std::optional<Turning>& seen,
                  const std::optional<serial::SerialDriveSettings>& settings);

/// Turns each wheel forward alone. @return whether both wheels obey, according to their encoders
bool test_turning(const DriveUnderTest& test, WheelBench& bench, const Surroundings& surroundings, Report& report);

/// Turns both wheels forward from standstill at the believed least speed. If they turn, it tries half of that speed,
/// otherwise higher speeds until they turn. A wheel turns if, within 4 s, it moves as far as in 1 s at that speed.
void test_least_speed(const DriveUnderTest& test, WheelBench& bench, const Surroundings& surroundings, Report& report);

/// Turns the left wheel by a number of counted turns, and compares it with the number that the user saw.
void test_counts_per_turn(const DriveUnderTest& test, WheelBench& bench, double counts_per_turn,
                          const Surroundings& surroundings, Report& report);

}  // namespace twocone::doctor

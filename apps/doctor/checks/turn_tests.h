// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "apps/doctor/checks/checks.h"
#include "apps/doctor/wheel_bench.h"

namespace twocone::doctor {

enum class Side { kLeft, kRight };
std::string_view to_string(Side side);

/// The motion of one wheel.
struct Turning {
  Side side = Side::kLeft;
  bool is_forward = true;

  friend bool operator==(const Turning&, const Turning&) = default;
};

/// Parses "lf", "left forward", "right back" and the like; nothing for a text that names no wheel or no direction.
std::optional<Turning> parse_turning(std::string_view text);

/// The angles that the encoders reported while one wheel was commanded forward.
struct Counted {
  double left_rad = 0;
  double right_rad = 0;
  double commanded_rad = 0;  ///< > 0

  /// Returns the only wheel that moved; nothing if none did, or both.
  [[nodiscard]] std::optional<Turning> turning() const;
  [[nodiscard]] bool has_nothing() const;
};

/// Finds reversed or exchanged connections. The file's swap_wheels and reverse_... exchange motors and encoders
/// together: they are the remedy where encoder and command agree, and the user saw another wheel or another direction.
/// Where encoder and command do not agree, no key helps, and a plug must be changed.
/// @param commanded forward. @param seen by the user, if there is one. @param settings where the file has any
Row judge_turning(Side commanded, const Counted& counted, const std::optional<Turning>& seen,
                  const std::optional<serial::SerialDriveSettings>& settings);

/// Turns each wheel forward alone. @return whether both obey, according to their encoders
bool test_turning(const DriveUnderTest& test, WheelBench& bench, const Surroundings& surroundings, Report& report);

/// Turns both wheels forward from standstill at the believed least speed: then at half of it if they turn, else faster
/// until they do. A wheel turns if, within 4 s, it moves as far as in 1 s at that speed.
void test_least_speed(const DriveUnderTest& test, WheelBench& bench, const Surroundings& surroundings, Report& report);

/// Turns the left wheel by a number of counted turns; the user states how many there were.
void test_counts_per_turn(const DriveUnderTest& test, WheelBench& bench, double counts_per_turn,
                          const Surroundings& surroundings, Report& report);

}  // namespace twocone::doctor

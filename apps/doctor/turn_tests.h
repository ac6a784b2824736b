// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "apps/doctor/drive_checks.h"
#include "apps/doctor/wheel_bench.h"

namespace twocone::doctor {

enum class Side { kLeft, kRight };
std::string_view to_string(Side side);
inline Side other(Side side) { return side == Side::kLeft ? Side::kRight : Side::kLeft; }

/// A wheel that turned by itself.
struct Turning {
  Side side = Side::kLeft;
  bool is_forward = true;

  friend bool operator==(const Turning&, const Turning&) = default;
};

/// "lf", "left forward", "right back" and the like; nothing for what tells no wheel or no way.
std::optional<Turning> parse_turning(std::string_view text);

/// What the encoders told of one wheel commanded forward.
struct Counted {
  double left_rad = 0;
  double right_rad = 0;
  double commanded_rad = 0;  ///< > 0

  /// The one wheel that moved; nothing where none did, or both.
  [[nodiscard]] std::optional<Turning> turning() const;
  [[nodiscard]] bool has_nothing() const;
};

/// What is wired the wrong way round. The file's swap_wheels and reverse_... exchange motors and encoders together:
/// they are right where encoder and command agree, and the person saw another wheel, or another way. Where encoder and
/// command do not agree, no key helps, but another plug.
/// @param commanded forward @param seen by the person, if one looked @param settings where the file has any
Row judge_turning(Side commanded, const Counted& counted, const std::optional<Turning>& seen,
                  const std::optional<serial::SerialDriveSettings>& settings);

Row judge_speed(Side side, double measured_radps, double commanded_radps);

/// The least speed from rest, of both wheels, as far as it was tried.
struct LeastSpeed {
  double believed_radps = 0;          ///< as the robot file or the protocol says; 0: nothing is believed
  std::optional<double> turns_radps;  ///< the least at which both turned
  std::optional<double> rests_radps;  ///< the greatest at which one did not
};
Row judge_least_speed(const LeastSpeed& measured);

/// @param counted, seen turns of the wheel, > 0 @param counts_per_turn as believed
Row judge_counts(double counted, double seen, double counts_per_turn);

/// Each wheel forward by itself. @return whether both obey, as their encoders tell
bool test_turning(const DriveUnderTest& test, WheelBench& bench, const Surroundings& surroundings, Report& report);

/// Both wheels forward from rest, at the least speed that is believed to turn them: half as fast if they turn, faster
/// until they do if not. Whatever turned less than half as far as it was told to does not turn.
void test_least_speed(const DriveUnderTest& test, WheelBench& bench, const Surroundings& surroundings, Report& report);

/// So many turns of the left wheel as counted; a person says how many there were.
void test_counts_per_turn(const DriveUnderTest& test, WheelBench& bench, double counts_per_turn,
                          const Surroundings& surroundings, Report& report);

}  // namespace twocone::doctor

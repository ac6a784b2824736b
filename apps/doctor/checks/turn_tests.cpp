// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/checks/wheel_bench.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace twocone::doctor {
namespace {

using std::numbers::pi;

constexpr double kTurnTime_s = 2;
constexpr double kSpinUp_s = 0.7;
// Fraction of the commanded angle. A wheel that turned by less stood still, except for vibration.
constexpr double kMoved = 0.1;
constexpr double kSpeedShare = 0.10, kPoorSpeedShare = 0.25;
constexpr double kTurns = 5;
// A user can read a mark on a wheel to an eighth of a turn.
constexpr double kReading_turns = 0.15;
constexpr double kPatience = 3;
// A stopped wheel continues to turn for about this time.
constexpr double kLead_s = 0.03;

constexpr const char* kLeastSpeed = "least speed";
// An integrating control loop needs time to overcome friction: one power step in each 33 ms.
constexpr double kLeastTime_s = 4;
// A wheel turns only if it has by then moved at least as far as in this time at the commanded speed.
constexpr double kLeastWay_s = 1;
constexpr double kFaster = 1.3;
// First tested fraction of the speed that a user can follow, if the least speed is unknown.
constexpr double kLeastGuess = 1.0 / 8;

std::string name_of(Side side, const char* ending) { return fmt::format("{} {}", to_string(side), ending); }

std::string describe(const Turning& turning) {
  return fmt::format("{} {}", to_string(turning.side), turning.is_forward ? "forward" : "backward");
}

/// Returns what to do if the wrong wheel turned, or an empty text.
std::string which_advice(Side commanded, const Turning& counted, const std::optional<Turning>& seen, bool is_swapped) {
  const bool counted_other = counted.side != commanded;
  if (!seen) {
    return counted_other ? "the plugs of the motors or of the encoders are crossed: watch which wheel turns" : "";
  }
  const bool seen_other = seen->side != commanded;
  if (counted_other && seen_other) return "the motors' plugs are crossed: exchange the two";
  if (counted_other) return "the encoders' plugs are crossed: exchange the two";
  if (seen_other) return is_swapped ? "swap_wheels: false" : "swap_wheels: true";
  return "";
}

/// Returns what to do if the wheel did not turn forward, or an empty text.
std::string way_advice(Side commanded, const Turning& counted, const std::optional<Turning>& seen, bool is_reversed) {
  const char* const side = to_string(commanded).data();
  if (!seen && counted.is_forward) return "";
  if (!seen) {
    return fmt::format(
        "exchange the {0} motor's two leads, or the {0} encoder's A and B: watch in which direction it turns", side);
  }
  if (!counted.is_forward && !seen->is_forward) return fmt::format("exchange the {} motor's two leads", side);
  if (!counted.is_forward) return fmt::format("exchange the {} encoder's A and B", side);
  if (!seen->is_forward) return fmt::format("reverse_{}: {}", side, !is_reversed);
  return "";
}

std::optional<Turning> ask_what_was_seen(const Surroundings& surroundings) {
  if (!surroundings.ask) return std::nullopt;
  const auto answer = surroundings.ask(
      "Which wheel turned, and would it drive the robot forward or backward? [lf, lb, rf, rb; Enter: not seen] ");
  end_if_asked(surroundings);
  return answer ? parse_turning(*answer) : std::nullopt;
}

/// Returns the speed in radians per second after the spin-up, or nothing if there are too few samples.
std::optional<double> speed_of(const Course& course, double WheelSample::*angle) {
  const double from_s = course.samples.front().t_s + kSpinUp_s;
  const auto first = std::ranges::find_if(course.samples, [from_s](const WheelSample& s) { return s.t_s >= from_s; });
  if (first == course.samples.end() || course.samples.back().t_s <= first->t_s) return std::nullopt;
  const WheelSample& last = course.samples.back();
  return (last.*angle - (*first).*angle) / (last.t_s - first->t_s);
}

Row judge_speed(Side side, double measured_radps, double commanded_radps) {
  Row row{kDrivePart, name_of(side, "speed"), fmt::format("{:.2f} rad/s of {:.2f}", measured_radps, commanded_radps)};
  const double off = std::abs(measured_radps - commanded_radps) / commanded_radps;
  if (off > kSpeedShare) {
    row.judge(off > kPoorSpeedShare ? kFailed : kWarning,
              "the controller does not reach the speed: check its PID, the battery, max_speed_mps");
  }
  return row;
}

/// Tests one wheel. @return whether it obeyed, according to its encoder
bool test_wheel(Side side, const DriveUnderTest& test, WheelBench& bench, const Surroundings& surroundings,
                bool& was_seen, Report& report) {
  const double speed = bench.speed_radps();
  const WheelSpeeds speeds = side == Side::kLeft ? WheelSpeeds{speed, 0} : WheelSpeeds{0, speed};
  const Course course = bench.drive(speeds, kTurnTime_s, name_of(side, "wheel"));
  bench.halt();
  if (course.error) {
    report.add(drive_failed(name_of(side, "wheel"), *course.error));
    return false;
  }
  if (course.samples.size() < 2) {
    report.add({kDrivePart, name_of(side, "wheel"), "too few readings of the angles", kFailed, "see angles"});
    return false;
  }
  const WheelSample& first = course.samples.front();
  const WheelSample& last = course.samples.back();
  const Counted counted{last.left_rad - first.left_rad, last.right_rad - first.right_rad,
                        speed * (last.t_s - first.t_s)};
  const auto seen = ask_what_was_seen(surroundings);
  was_seen = was_seen && seen;
  Row row = judge_turning(side, counted, seen, test.asked.serial);
  if (course.ran_away) {
    row.verdict = kFailed;
    row.measured += "; it ran away and was stopped";
    // A control loop that reads the other wheel's encoder never measures its own motor. It drives with full power, and
    // the other loop works against it.
    if (!counted.turning() && !counted.has_nothing()) {
      row.advice = "the control loops cross: exchange the two motors' plugs, not the encoders'; run it again";
    }
    if (row.advice.empty()) row.advice = "check the controller's PID and counts_per_turn";
  }
  report.add(row);
  if (course.ran_away || counted.turning() != Turning{side, true}) return false;
  const auto measured = speed_of(course, side == Side::kLeft ? &WheelSample::left_rad : &WheelSample::right_rad);
  if (measured) report.add(judge_speed(side, *measured, speed));
  return true;
}

std::optional<double> parse_turns(const std::string& text) {
  double turns = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), turns);
  if (error != std::errc() || end != text.data() + text.size() || !(turns > 0) || !std::isfinite(turns)) {
    return std::nullopt;
  }
  return turns;
}

/// The least speed of both wheels from standstill, as far as it was tested.
struct LeastSpeed {
  double believed_radps = 0;           ///< according to the robot file or the protocol; 0: unknown
  std::optional<double> turns_radps;   ///< the lowest tested speed at which both turned
  std::optional<double> stands_radps;  ///< the greatest tested speed at which one did not turn
};
Row judge_least_speed(const LeastSpeed& measured) {
  Row row{kDrivePart, kLeastSpeed, ""};
  if (!measured.turns_radps) {
    row.measured = fmt::format("{:.2f} rad/s does not turn both wheels", measured.stands_radps.value_or(0));
    row.judge(kWarning, "check the gains of its control loop; see the wheels' rows");
    return row;
  }
  row.measured = fmt::format("{:.2f} rad/s turns both wheels", *measured.turns_radps);
  if (measured.stands_radps) row.measured += fmt::format(", {:.2f} does not", *measured.stands_radps);
  // It is no fault if half of the believed speed does not turn them.
  if (measured.stands_radps && *measured.stands_radps >= measured.believed_radps) {
    row.verdict = kWarning;
    // The value is rounded up, because a lower speed was not seen to turn them.
    row.advice = fmt::format("set least_speed_radps: {:.2f}; slower commands turn no wheel",
                             std::ceil(100 * *measured.turns_radps) / 100);
  }
  return row;
}

/// @param counted,seen turns of the wheel, > 0. @param counts_per_turn as believed
Row judge_counts(double counted, double seen, double counts_per_turn) {
  Row row{kDrivePart, "counts per turn", fmt::format("{:.2f} turns seen, {:.2f} counted", seen, counted)};
  if (std::abs(seen - counted) > kReading_turns) {
    row.judge(kFailed, fmt::format("counts_per_turn: {:.4g} instead of {:g}", counts_per_turn * counted / seen,
                                   counts_per_turn));
  }
  return row;
}

}  // namespace

std::string_view to_string(Side side) { return side == Side::kLeft ? "left" : "right"; }

std::optional<Turning> parse_turning(std::string_view text) {
  std::string letters(text);
  std::erase_if(letters, [](char c) { return c == ' ' || c == ','; });
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const std::string_view name = to_string(side);
    for (const std::string_view begin : {name, name.substr(0, 1)}) {
      if (!letters.starts_with(begin)) continue;
      const std::string way = letters.substr(begin.size());
      if (way.empty()) continue;
      if (std::string_view("forward").starts_with(way) || way == "forwards") return Turning{side, true};
      if (std::string_view("backward").starts_with(way) || way == "backwards") return Turning{side, false};
    }
  }
  return std::nullopt;
}

bool Counted::has_nothing() const { return std::max(std::abs(left_rad), std::abs(right_rad)) < kMoved * commanded_rad; }

std::optional<Turning> Counted::turning() const {
  const bool left = std::abs(left_rad) >= kMoved * commanded_rad;
  const bool right = std::abs(right_rad) >= kMoved * commanded_rad;
  if (left == right) return std::nullopt;
  return left ? Turning{Side::kLeft, left_rad > 0} : Turning{Side::kRight, right_rad > 0};
}

Row judge_turning(Side commanded, const Counted& counted, const std::optional<Turning>& seen,
                  const std::optional<serial::SerialDriveSettings>& settings) {
  Row row{kDrivePart, name_of(commanded, "wheel"),
          fmt::format("{:.1f} rad commanded: left {:+.1f}, right {:+.1f}{}", counted.commanded_rad, counted.left_rad,
                      counted.right_rad, seen ? "; seen: " + describe(*seen) : "")};
  const auto turning = counted.turning();
  if (!turning) {
    row.verdict = kFailed;
    if (!counted.has_nothing()) {
      row.advice = "both turn although one was commanded: check the encoders' wiring and the controller's program";
    } else {
      row.advice = seen ? "it turns but is not counted: check the encoder's plug and power"
                        : "check the motors' power, the emergency stop, the plugs of motor and encoder";
    }
    return row;
  }
  const auto as_is = settings.value_or(serial::SerialDriveSettings{});
  row.advice = which_advice(commanded, *turning, seen, as_is.swap_wheels);
  if (row.advice.empty()) {
    row.advice =
        way_advice(commanded, *turning, seen, commanded == Side::kLeft ? as_is.reverse_left : as_is.reverse_right);
  }
  if (!row.advice.empty()) row.verdict = kFailed;
  return row;
}

bool test_turning(const DriveUnderTest& test, WheelBench& bench, const Surroundings& surroundings, Report& report) {
  bool was_seen = true;
  bool obey = test_wheel(Side::kLeft, test, bench, surroundings, was_seen, report);
  obey = test_wheel(Side::kRight, test, bench, surroundings, was_seen, report) && obey;
  if (!was_seen) {
    report.add({kDrivePart, "wheels seen", "the encoders cannot show which wheel turned in which direction", kNotRun,
                "run it in a terminal and watch the wheels"});
  }
  return obey;
}

void test_least_speed(const DriveUnderTest& test, WheelBench& bench, const Surroundings& surroundings, Report& report) {
  LeastSpeed found;
  if (test.asked.serial) found.believed_radps = serial::least_speed_radps(*test.asked.serial);
  std::optional<Error> error;
  /// Returns whether both wheels turn at that speed.
  const auto turns = [&](double speed) {
    end_if_asked(surroundings);
    std::optional<WheelSample> first;
    const auto is_far = [&](const WheelSample& sample) {
      if (!first) first = sample;
      const double way_rad = std::max(speed * kLeastWay_s, bench.still_rad());
      return std::min(sample.left_rad - first->left_rad, sample.right_rad - first->right_rad) >= way_rad;
    };
    const Course course = bench.drive({speed, speed}, kLeastTime_s, kLeastSpeed, is_far);
    bench.halt();
    if (course.error) error = course.error;
    if (course.samples.empty() || !is_far(course.samples.back())) {
      found.stands_radps = std::max(speed, found.stands_radps.value_or(0));
      return false;
    }
    found.turns_radps = std::min(speed, found.turns_radps.value_or(speed));
    return true;
  };
  double speed = found.believed_radps > 0 ? found.believed_radps : kLeastGuess * bench.speed_radps();
  if (turns(speed)) {
    const bool is_refused = !turns(speed / 2) && error && error->code == ErrorCode::kRefused;
    if (is_refused) {  // the controller cannot represent such a low speed
      error.reset();
      found.stands_radps.reset();
    }
  } else {
    while (!error && !found.turns_radps && speed < bench.speed_radps())
      turns(speed = std::min(kFaster * speed, bench.speed_radps()));
  }
  if (error) return report.add(drive_failed(kLeastSpeed, *error));
  report.add(judge_least_speed(found));
}

void test_counts_per_turn(const DriveUnderTest& test, WheelBench& bench, double counts_per_turn,
                          const Surroundings& surroundings, Report& report) {
  const auto not_run = [&](std::string measured, std::string advice) {
    report.add({kDrivePart, "counts per turn", std::move(measured), kNotRun, std::move(advice)});
  };
  if (!(counts_per_turn > 0)) return not_run("its angles are not counted", "");
  if (!surroundings.ask) return not_run("no user counts the turns", "run it in a terminal");
  const auto ready = surroundings.ask(fmt::format(
      "Put a mark on the left wheel: it will turn {:g} times by its counts. [Enter: start, no: skip] ", kTurns));
  end_if_asked(surroundings);
  if (!ready || !ready->empty()) return not_run("skipped", "run it again and press Enter");

  const auto begin = bench.read();
  if (!begin) return report.add(drive_failed("counts per turn", begin.error()));
  const double speed = bench.speed_radps();
  const double goal_rad = begin->left_rad + 2 * pi * kTurns - speed * kLead_s;
  const Course course = bench.drive({speed, 0}, kPatience * 2 * pi * kTurns / speed, "counting turns",
                                    [&](const WheelSample& sample) { return sample.left_rad >= goal_rad; });
  bench.halt();
  const auto end = bench.read();
  if (course.error || !end) {
    const Error& error = course.error ? *course.error : end.error();
    return report.add(drive_failed("counts per turn", error));
  }
  const double counted = (end->left_rad - begin->left_rad) / (2 * pi);
  const auto answer = surroundings.ask("How many turns did it make, for example 4.75? [Enter: not seen] ");
  end_if_asked(surroundings);
  const auto seen = answer ? parse_turns(*answer) : std::nullopt;
  if (!seen) return not_run(fmt::format("{:.2f} turns counted, no number given by the user", counted), "run it again");
  report.add(
      judge_counts(counted, *seen,
                   test.asked.serial ? test.asked.serial->counts_per_turn.value_or(counts_per_turn) : counts_per_turn));
}

}  // namespace twocone::doctor

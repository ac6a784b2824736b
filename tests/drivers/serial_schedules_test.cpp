// SPDX-License-Identifier: Apache-2.0
// Program, watchdog and controller in one simulated time, with delays, suspensions, resets, lost and garbled bytes
// drawn from a seed. TWOCONE_SCHEDULES=N runs N schedules; TWOCONE_SCHEDULE=SEED runs only that one and prints its
// events.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include "hal/device_info.h"
#include "tests/emulator/simulated_line.h"

namespace twocone::serial {
namespace {

using namespace std::chrono_literals;
using emulator::SimulatedLine;
using emulator::SimulatedWatchdog;
using std::chrono::nanoseconds;
using testing::HasSubstr;

constexpr double kBoardCountsPerTurn = 1440;
constexpr int kSchedules = 300;

// A row of stops takes 30 ms, the watchdog wakes up to 3 ms late and decides within 1 ms, a stop's 7 bytes take 1.3 ms
// on the line behind at most 100 others, and the time resolution is one millisecond: 53 ms. The documented limit is
// 100 ms.
constexpr nanoseconds kScheduleGrace = 100ms;
// Failures must end within this time after the end of the faults.
constexpr nanoseconds kOver = 300ms;

double seconds(nanoseconds time) { return std::chrono::duration<double>(time).count(); }
int number_of(const char* variable, int otherwise) {
  const char* const text = std::getenv(variable);
  return text != nullptr ? std::atoi(text) : otherwise;
}

SerialDriveSettings settings() {
  SerialDriveSettings settings;
  settings.port = "the simulated line";
  settings.protocol = "ros_arduino_bridge";
  settings.counts_per_turn = kBoardCountsPerTurn;
  return settings;
}

/// The kinds of faults in a schedule.
enum class Kind {
  kDelays,    ///< the program commands about once per command_timeout; the line has no faults
  kHoldUps,   ///< the program is suspended for about command_timeout, at any of its system calls
  kResets,    ///< the board is reset, with and without a boot loader's pause
  kLine,      ///< bytes are lost and garbled
  kWatchdog,  ///< the watchdog is halted or killed
  kAll,
};
constexpr int kKinds = 6;
const char* name_of(Kind kind) {
  constexpr const char* kNames[kKinds]{"delays", "hold-ups", "resets", "line", "watchdog", "all"};
  return kNames[int(kind)];
}

struct Outcome {
  Kind kind{};
  int calls = 0, failed = 0;
  nanoseconds over{0};          ///< time of the last failure after the end of the faults
  nanoseconds longest_turn{0};  ///< longest power after the last command that moves, less command_timeout
  nanoseconds noticed{0};       ///< power after the call of a command that moves while the watchdog is halted or dead
  std::string wrong;            ///< description of the first error; empty: none
};

class Schedule {
 public:
  Schedule(std::uint64_t seed, bool is_printed)
      : kind_(Kind(seed % kKinds)), is_printed_(is_printed), random_(seed), line_(seed, latency()) {
    timeout_ = pick({100ms, 150ms, 200ms, 300ms, 500ms});
    outcome_.kind = kind_;
  }

  Outcome go() {
    begin_ = line_.now();
    line_.watch = [this] { watch(); };
    line_.trace = [this](const char* who, std::span<const std::uint8_t> bytes) {
      std::string text;
      for (const std::uint8_t byte : bytes) text += byte == '\r' ? std::string("|") : fmt::format("{:c}", byte);
      print(fmt::format("    {}: {}", who, printable(text)));
    };
    auto opened = open_drive(settings(), {12, timeout_}, line_.machine());
    if (!opened) {
      outcome_.wrong = "does not open: " + opened.error().message;
      return outcome_;
    }
    drive_ = *std::move(opened);
    trouble();
    calm();
    drive_.reset();
    line_.advance(kScheduleGrace);
    if (line_.board().has_power()) complain("the wheels have power after the drive's end");
    return outcome_;
  }

 private:
  nanoseconds latency() { return pick({0ms, 1ms, 16ms}); }
  nanoseconds pick(std::initializer_list<nanoseconds> values) { return values.begin()[random_() % values.size()]; }
  [[nodiscard]] bool is(std::initializer_list<Kind> kinds) const {
    return kind_ == Kind::kAll || std::find(kinds.begin(), kinds.end(), kind_) != kinds.end();
  }
  double share() { return std::uniform_real_distribution<>(0, 1)(random_); }
  nanoseconds about_timeout() { return nanoseconds(std::int64_t(double(timeout_.count()) * (0.85 + 0.3 * share()))); }

  /// Runs the part of the schedule with faults.
  void trouble() {
    const nanoseconds end = line_.now() + line_.draw(400ms, 2000ms);
    line_.troubles.end = end;
    if (is({Kind::kHoldUps})) {
      line_.troubles.hold_up = 0.02;
      line_.troubles.shortest_hold_up = timeout_ / 2;
      line_.troubles.longest_hold_up = timeout_ * 3 / 2;
    }
    if (is({Kind::kLine})) {
      line_.troubles.lose = 0.1 * share() * share();
      line_.troubles.garble = share() < 0.5 ? 0 : 0.05 * share();
    }
    while (line_.now() < end) {
      if (is({Kind::kResets}) && share() < 0.1) reset();
      if (is({Kind::kWatchdog}) && share() < 0.1) strike_watchdog();
      call(share() < 0.15 ? WheelSpeeds{} : WheelSpeeds{1 + 4 * share(), 1 + 4 * share()});
      line_.advance(share() < (kind_ == Kind::kDelays ? 0.8 : 0.2) ? about_timeout() : line_.draw(1ms, 40ms));
    }
    while (line_.now() < boots_until_) {
      call({2, 2});
      line_.advance(line_.draw(10ms, 40ms));
    }
    if (line_.watchdog != nullptr && line_.watchdog->is_halted()) line_.watchdog->halt_until(line_.now());
    well_ = line_.now();
  }

  /// Runs the part without faults: after kOver no call fails any more.
  void calm() {
    const nanoseconds end = line_.now() + kOver + 600ms;
    while (line_.now() < end) {
      call({2, 3});
      line_.advance(line_.draw(10ms, 40ms));
    }
  }

  void reset() {
    const nanoseconds silence = share() < 0.8 ? 0ms : line_.draw(200ms, 1700ms);
    line_.reset_board(silence);
    boots_until_ = line_.now() + silence;
    print(fmt::format("reset, silent for {:.3f} s", seconds(silence)));
  }

  void strike_watchdog() {
    if (line_.watchdog == nullptr || line_.watchdog->is_halted()) return;
    print("the watchdog is halted or killed");
    watchdog_struck_ = line_.now();
    if (share() < 0.5) {
      line_.watchdog->die();
    } else {
      line_.watchdog->halt_until(line_.now() + about_timeout() * 2);
    }
  }

  void call(const WheelSpeeds& speeds) {
    const nanoseconds set_at = line_.now();
    if (speeds.left_radps != 0) commanded_ = set_at;
    const nanoseconds held_up = line_.held_up;
    const double moved_s = line_.board().moved_s();
    const bool is_unwatched =
        kind_ == Kind::kWatchdog && speeds.left_radps != 0 && is_unwatched_until(set_at + timeout_);
    unwatched_ = is_unwatched ? set_at : SimulatedLine::kNever;
    const auto set = drive_->set_speeds(speeds);
    note("set", set_at, set ? nullptr : &set.error());
    unwatched_ = SimulatedLine::kNever;
    if (is_unwatched && set) complain("still drives without its watchdog");
    if (is_unwatched && !set && set.error().code != ErrorCode::kUnavailable) {
      complain("the error does not name the watchdog: " + set.error().message);
    }
    const bool is_well = line_.troubles.end == 0ns || !is({Kind::kLine});
    if (!set && line_.board().moved_s() != moved_s && is_well && set.error().code != ErrorCode::kDisconnected) {
      // The failed command was carried out: then the wheels must be stopped, and the message must state that.
      line_.advance(5ms);
      if (line_.board().has_power()) complain("the wheels turn after a failed command: " + set.error().message);
      const std::string& message = set.error().message;
      if (message.find("stop") == std::string::npos) complain("the message does not report the stop: " + message);
    }
    const nanoseconds read_at = line_.now();
    const auto angles = drive_->read_angles();
    note("read", read_at, angles ? nullptr : &angles.error());
    if (kind_ != Kind::kDelays) return;
    // The line has no faults and the program is not suspended: no call fails, and each answer belongs to its question.
    if (!set || !angles) complain("failed: " + (set ? angles.error().message : set.error().message));
    if (angles) check_counts(*angles, read_at);
    if (line_.held_up != held_up) complain("suspended");
  }

  /// Returns whether the watchdog will do nothing until that time.
  [[nodiscard]] bool is_unwatched_until(nanoseconds time) const {
    return line_.watchdog != nullptr && line_.watchdog->is_out_until(time);
  }

  /// Checks that the counts are between those at the time of the question and those at the time of the answer.
  void check_counts(const WheelAngles& angles, nanoseconds read_at) {
    const double count = angles.left_rad * kBoardCountsPerTurn / (2 * std::numbers::pi);
    const double now = std::floor(line_.board().wheels.left());
    if (count > now + 0.5 || count < counts_at(read_at) - 1.5) {
      complain(fmt::format("counts {}, but the wheel had {} to {}", count, counts_at(read_at), now));
    }
  }
  [[nodiscard]] double counts_at(nanoseconds time) const {
    for (auto it = counts_.rbegin(); it != counts_.rend(); ++it) {
      if (it->first <= time) return it->second;
    }
    return 0;
  }

  void note(const char* what, nanoseconds begun, const Error* error) {
    ++outcome_.calls;
    const nanoseconds took = line_.now() - begun;
    if (error == nullptr) {
      print(fmt::format("{} ok, {:.1f} ms", what, 1e3 * seconds(took)));
      return;
    }
    ++outcome_.failed;
    print(fmt::format("{} failed, {:.1f} ms: {}", what, 1e3 * seconds(took), error->message));
    if (well_ == 0ns) return;
    outcome_.over = std::max(outcome_.over, line_.now() - well_);
    if (outcome_.over > kOver) {
      complain(fmt::format("failed {:.3f} s after the end of the faults: {}", seconds(outcome_.over), error->message));
    }
  }

  /// Called each millisecond: checks that no wheel has power that it must not have.
  void watch() {
    counts_.emplace_back(line_.now(), std::floor(line_.board().wheels.left()));
    if (counts_.size() > 3000) counts_.pop_front();
    if (!line_.board().has_power()) return;
    if (line_.now() > unwatched_) {
      outcome_.noticed = std::max(outcome_.noticed, line_.now() - unwatched_);
      if (line_.now() > unwatched_ + timeout_) complain("power without a watchdog");
    }
    const nanoseconds moved = begin_ + nanoseconds(std::int64_t(1e9 * line_.board().moved_s()));
    // The time counts from the call of a command: if the program is suspended in it, the wheels turn by the previous
    // one.
    nanoseconds since = std::max(moved, commanded_);
    // While bytes are lost, a stop may be lost too; a watchdog that is halted or dead stops nothing.
    if (is({Kind::kLine})) since = std::max(since, line_.troubles.end);
    if (is({Kind::kWatchdog})) {
      if (line_.watchdog == nullptr || line_.watchdog->is_halted())
        watchdog_struck_ = std::max(watchdog_struck_, line_.now());
      since = std::max(since, watchdog_struck_);
    }
    outcome_.longest_turn = std::max(outcome_.longest_turn, line_.now() - since - timeout_);
    if (line_.now() - since > timeout_ + kScheduleGrace) {
      complain(fmt::format("wheels turn {:.3f} s after the last command, command_timeout is {:.3f} s",
                           seconds(line_.now() - since), seconds(timeout_)));
    }
    // The firmware's own time-out works whatever else is broken.
    if (line_.now() - moved > 2100ms + nanoseconds(0)) complain("wheels turn for more than 2 s");
  }

  void complain(const std::string& what) {
    if (outcome_.wrong.empty()) outcome_.wrong = fmt::format("{:.4f} s: {}", seconds(line_.now() - begin_), what);
    print("WRONG: " + what);
  }
  void print(const std::string& what) const {
    if (is_printed_) fmt::print("{:8.4f} {}\n", seconds(line_.now() - begin_), what);
  }

  const Kind kind_;
  const bool is_printed_;
  std::mt19937_64 random_;
  SimulatedLine line_;
  nanoseconds timeout_{};
  nanoseconds begin_{0};
  std::unique_ptr<DiffDrive> drive_;
  nanoseconds boots_until_{0}, watchdog_struck_{0}, well_{0}, commanded_{0};
  nanoseconds unwatched_ = SimulatedLine::kNever;  // start of the call that must notice a missing watchdog
  std::deque<std::pair<nanoseconds, double>> counts_;
  Outcome outcome_;
};

std::unique_ptr<DiffDrive> opened(SimulatedLine& line, nanoseconds timeout) {
  auto drive = open_drive(settings(), {12, timeout}, line.machine());
  EXPECT_TRUE(drive) << drive.error().message;
  return drive ? *std::move(drive) : nullptr;
}

// Catches a driver that stays one line behind the board after its reset, until the port is opened again.
TEST(SerialSchedules, AResetWithoutABootLoaderIsSoonOver) {
  for (int trial = 0; trial < 10; ++trial) {
    SimulatedLine line(std::uint64_t(trial), 1ms);
    const auto drive = opened(line, 500ms);
    ASSERT_TRUE(drive);
    // The drive runs so long that the counters' return to zero exceeds the possible motion of the wheels.
    for (int i = 0; i < 60 + 3 * trial; ++i) {
      EXPECT_TRUE(drive->set_speeds({5, 5}));
      EXPECT_TRUE(drive->read_angles());
      line.advance(40ms);
    }
    line.reset_board(0ms);
    const nanoseconds reset = line.now();
    int failed = 0;
    nanoseconds over = reset;
    while (line.now() < reset + 5s) {
      const bool set = drive->set_speeds({5, 5}).has_value();
      const bool read = drive->read_angles().has_value();
      failed += !set + !read;
      if (!set || !read) over = line.now();
      line.advance(40ms);
    }
    EXPECT_GE(failed, 1) << "the reset was not noticed";
    EXPECT_LE(over - reset, kOver) << "trial " << trial << ": " << seconds(over - reset) << " s, " << failed
                                   << " calls";
  }
}

// Catches answers to the watchdog's stops that are taken as the program's, if the interval between commands is about
// the time-out.
TEST(SerialSchedules, CommandsAboutAsFarApartAsTheTimeoutAllSucceed) {
  for (nanoseconds period = 485ms; period <= 530ms; period += 1ms) {
    SimulatedLine line(std::uint64_t(period.count()), 1ms);
    const auto drive = opened(line, 500ms);
    ASSERT_TRUE(drive);
    for (int i = 0; i < 16; ++i) {
      const nanoseconds begun = line.now();
      const auto set = drive->set_speeds({5, 5});
      EXPECT_TRUE(set) << seconds(period) << " s: " << set.error().message;
      const auto angles = drive->read_angles();
      EXPECT_TRUE(angles) << seconds(period) << " s: " << angles.error().message;
      line.advance_to(begun + period);
    }
  }
}

TEST(SerialSchedules, NoWheelTurnsTooLongAndEveryFailureIsSoonOver) {
  const int only = number_of("TWOCONE_SCHEDULE", -1);
  const int schedules = number_of("TWOCONE_SCHEDULES", kSchedules);
  struct Sum {
    int schedules = 0, wrong = 0, calls = 0, failed = 0;
    nanoseconds over{0}, longest_turn{0}, noticed{0};
  };
  Sum sums[kKinds];
  for (int seed = only >= 0 ? only : 0; seed < (only >= 0 ? only + 1 : schedules); ++seed) {
    const Outcome outcome = Schedule(std::uint64_t(seed), only >= 0).go();
    Sum& sum = sums[int(outcome.kind)];
    ++sum.schedules;
    sum.wrong += !outcome.wrong.empty();
    sum.calls += outcome.calls;
    sum.failed += outcome.failed;
    sum.over = std::max(sum.over, outcome.over);
    sum.noticed = std::max(sum.noticed, outcome.noticed);
    sum.longest_turn = std::max(sum.longest_turn, outcome.longest_turn);
    EXPECT_EQ(outcome.wrong, "") << "schedule " << seed << ", " << name_of(outcome.kind);
    if (sum.wrong > 20) break;
  }
  for (int i = 0; i < kKinds; ++i) {
    const Sum& s = sums[i];
    fmt::print(
        "schedules {}: {} run, {} wrong, {} calls, {} failed, last failure {:.3f} s after the line was well, "
        "wheels at most {:.3f} s beyond command_timeout, watchdog missed within {:.3f} s\n",
        name_of(Kind(i)), s.schedules, s.wrong, s.calls, s.failed, seconds(s.over), seconds(s.longest_turn),
        seconds(s.noticed));
  }
}

}  // namespace
}  // namespace twocone::serial

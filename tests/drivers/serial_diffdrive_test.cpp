// SPDX-License-Identifier: Apache-2.0
// Tests of the drive with an emulator that answers in real time: odometry across wraps, resets and unplugging, and
// wheels that stop whatever happens to the program.
#include "drivers/serial_diffdrive/serial_diffdrive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "tests/emulator/plug.h"
#include "tests/support/fails_with.h"
#include "tests/support/value.h"

namespace twocone::serial {
namespace {

using namespace std::chrono_literals;
using emulator::Plug;
using testing::AllOf;
using testing::HasSubstr;
using testing_support::FailsWith;
using testing_support::value;

constexpr double kCountsPerTurn = 508.8;
constexpr auto kTimeout = 300ms;
constexpr DriveLimits kLimits{12, kTimeout};
/// The largest delay of a stop after the time-out.
constexpr auto kGrace = 100ms;

/// Measures how long this machine delays a process that is ready to run and, like a watchdog, has its own session.
class Lateness {
 public:
  Lateness() {
    void* const shared = ::mmap(nullptr, sizeof(Longest), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) throw std::runtime_error("no memory");
    longest_ns_ = new (shared) Longest(0);
    process_ = ::fork();
    if (process_ == 0) watch();
  }
  ~Lateness() {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
    ::munmap(longest_ns_, sizeof(Longest));
  }
  Lateness(const Lateness&) = delete;
  Lateness& operator=(const Lateness&) = delete;
  [[nodiscard]] std::chrono::nanoseconds longest() const { return std::chrono::nanoseconds(*longest_ns_); }

 private:
  using Longest = std::atomic<std::int64_t>;

  [[noreturn]] void watch() const {
    ::setsid();
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    while (true) {
      const auto due = std::chrono::steady_clock::now() + 1ms;
      std::this_thread::sleep_until(due);
      const std::chrono::nanoseconds late = std::chrono::steady_clock::now() - due;
      *longest_ns_ = std::max<std::int64_t>(*longest_ns_, late.count());
    }
  }

  Longest* longest_ns_ = nullptr;
  pid_t process_ = -1;
};

// A longer delay by the machine makes a late stop inconclusive. An idle machine takes a few milliseconds of the grace.
constexpr auto kSpoilt = 10ms;
constexpr int kTries = 20;

using SteadyTime = std::chrono::steady_clock::time_point;

/// Calls `deed`, which returns the time at which the time-out began, and expects the wheels to stop at most `kGrace`
/// after the time-out; then calls `after`. If the machine delayed a process meanwhile, a late stop is tried again; but
/// the wheels must stop in every case.
void expect_stop_by_timeout(
    Plug& plug, const std::function<SteadyTime()>& deed, const std::function<void()>& after = [] {}) {
  for (int i = 0; i < kTries; ++i) {
    const Lateness lateness;
    const SteadyTime begun = deed();
    auto stopped = plug.server().stopped_at();
    for (const auto end = begun + kTimeout + 3s; stopped < begun && std::chrono::steady_clock::now() < end;) {
      std::this_thread::sleep_for(5ms);
      stopped = plug.server().stopped_at();
    }
    const bool was_late = lateness.longest() >= kSpoilt;
    after();
    ASSERT_GE(stopped, begun) << "the wheels still turn";
    if (stopped - begun <= kTimeout + kGrace) return;
    ASSERT_TRUE(was_late) << "they stopped only after " << std::chrono::duration<double>(stopped - begun).count()
                          << " s";
  }
  FAIL() << "in " << kTries << " tries the machine was too slow, or the wheels stopped too late";
}

class SerialDrive : public testing::TestWithParam<const char*> {
 protected:
  std::unique_ptr<DiffDrive> open() {
    return value(open_drive(plug_.settings(kCountsPerTurn), kLimits, plug_.machine()));
  }
  /// Returns whether the wheels soon turn, or soon stop. It waits because Create 2 does not answer commands.
  bool comes_to(bool turn) {
    for (const auto end = std::chrono::steady_clock::now() + 2s; std::chrono::steady_clock::now() < end;) {
      if (plug_.server().turns() == turn) return true;
      std::this_thread::sleep_for(1ms);
    }
    return false;
  }
  /// Returns whether the wheels turn after a command. It repeats the command, because on a slow machine the dead-man
  /// rule may stop the wheels before the check.
  bool can_be_driven(DiffDrive& drive) {
    for (const auto end = std::chrono::steady_clock::now() + 5s; std::chrono::steady_clock::now() < end;) {
      static_cast<void>(drive.set_speeds({5, 5}));
      plug_.server().catch_up();
      if (plug_.server().turns()) return true;
      std::this_thread::sleep_for(5ms);
    }
    return false;
  }
  /// Reads the angles; tries again for a while, because the machine may be slow.
  static Result<WheelAngles> read(DiffDrive& drive) {
    Result<WheelAngles> angles = drive.read_angles();
    for (const auto end = std::chrono::steady_clock::now() + 3s; !angles && std::chrono::steady_clock::now() < end;) {
      std::this_thread::sleep_for(20ms);
      angles = drive.read_angles();
    }
    return angles;
  }
  Plug plug_{GetParam()};
};

/// The result of drive_for(), which commands and reads repeatedly for a time.
struct Driven {
  int failed = 0;  ///< failed calls; 0 if the machine was slow
  bool was_late = false;
  std::optional<WheelAngles> first, last;
};
Driven drive_for(DiffDrive& drive, const WheelSpeeds& speeds, std::chrono::milliseconds time) {
  const Lateness lateness;
  Driven driven;
  for (const auto end = std::chrono::steady_clock::now() + time; std::chrono::steady_clock::now() < end;) {
    driven.failed += !drive.set_speeds(speeds);
    if (const auto angles = drive.read_angles()) {
      if (!driven.first) driven.first = *angles;
      driven.last = *angles;
    } else {
      ++driven.failed;
    }
    std::this_thread::sleep_for(20ms);
  }
  driven.was_late = lateness.longest() >= kSpoilt;
  if (driven.was_late) driven.failed = 0;
  return driven;
}
int keep_driving(DiffDrive& drive, const WheelSpeeds& speeds, std::chrono::milliseconds time) {
  return drive_for(drive, speeds, time).failed;
}

TEST_P(SerialDrive, TurnsTheWheelsAndReportsIt) {
  const auto drive = open();
  Driven driven;
  double left_off = INFINITY, right_off = INFINITY;
  // The first command takes a few milliseconds to arrive, and counts are whole numbers.
  const auto is_right = [&] { return std::abs(left_off) <= 3 * 0.08 && std::abs(right_off) <= 2 * 0.08; };
  for (int i = 0; i < kTries && !is_right(); ++i) {
    driven = drive_for(*drive, {3, -2}, 500ms);
    ASSERT_EQ(driven.failed, 0);
    ASSERT_TRUE(driven.first);
    EXPECT_EQ(driven.first->time.clock, ClockKind::kSteady);
    const double time_s = std::chrono::duration<double>(driven.last->time - driven.first->time).count();
    left_off = driven.last->left_rad - driven.first->left_rad - 3 * time_s;
    right_off = driven.last->right_rad - driven.first->right_rad + 2 * time_s;
    if (!driven.was_late) break;
  }
  EXPECT_TRUE(is_right()) << left_off << " and " << right_off << " rad off";
  EXPECT_TRUE(drive->stop());
  EXPECT_TRUE(comes_to(false));
}

TEST_P(SerialDrive, CountersThatWrapAreNoJump) {
  const double near = GetParam() == std::string("create2") ? 65535 - 20 : 2147483647.0 - 20;
  plug_.server().with([&](emulator::Firmware& firmware) { firmware.wheels.set_counts(near, -near); });
  const auto drive = open();
  EXPECT_EQ(keep_driving(*drive, {4, -4}, 400ms), 0);
  const auto after = read(*drive);
  ASSERT_TRUE(after);
  EXPECT_GT(after->left_rad, 0.8);
  EXPECT_LT(after->left_rad, 4.0);
  EXPECT_LT(after->right_rad, -0.8);
  EXPECT_GT(after->right_rad, -4.0);
}

TEST_P(SerialDrive, AResetOfTheBoardIsReportedOnceAndIsNoJump) {
  plug_.server().with([](emulator::Firmware& firmware) { firmware.wheels.set_counts(25000, 25000); });
  const auto drive = open();
  EXPECT_EQ(keep_driving(*drive, {2, 2}, 200ms), 0);
  const auto before = read(*drive);
  ASSERT_TRUE(before);
  plug_.server().with([](emulator::Firmware& firmware) { firmware.reset(); });
  const auto after = read(*drive);
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_NEAR(after->left_rad, before->left_rad, 0.2);
  EXPECT_TRUE(can_be_driven(*drive));
}

TEST_P(SerialDrive, ComesBackAfterAnUnplugWithoutAJump) {
  const auto drive = open();
  EXPECT_EQ(keep_driving(*drive, {5, 5}, 200ms), 0);
  const auto before = read(*drive);
  ASSERT_TRUE(before);
  plug_.unplug();
  const auto unplugged = std::chrono::steady_clock::now();
  EXPECT_THAT(drive->set_speeds({5, 5}), FailsWith(ErrorCode::kDisconnected));
  EXPECT_LT(std::chrono::steady_clock::now() - unplugged, 1s);
  EXPECT_FALSE(drive->read_angles());
  std::this_thread::sleep_for(300ms);
  EXPECT_FALSE(drive->set_speeds({5, 5}));
  plug_.plug_in();
  const auto end = std::chrono::steady_clock::now() + 5s;
  while (!drive->set_speeds({5, 5}) && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(20ms);
  const auto after = read(*drive);
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_GE(after->left_rad, before->left_rad);
  EXPECT_LT(after->left_rad, before->left_rad + 1.5);
  EXPECT_TRUE(can_be_driven(*drive));
}

TEST_P(SerialDrive, StopsByItselfWhenNoCommandComes) {
  const auto drive = open();
  const auto command = [&] {
    EXPECT_TRUE(drive->set_speeds({5, 5}));
    return std::chrono::steady_clock::now();
  };
  expect_stop_by_timeout(plug_, command);
  // Readings do not replace commands.
  expect_stop_by_timeout(plug_, [&] {
    const auto commanded = command();
    while (std::chrono::steady_clock::now() < commanded + kTimeout + kGrace) {
      static_cast<void>(drive->read_angles());  // the watchdog's stop may disturb an exchange
      std::this_thread::sleep_for(20ms);
    }
    return commanded;
  });
  EXPECT_TRUE(can_be_driven(*drive)) << "a new command moves it again";
}

// Catches a program that removes its watchdog's deadline before the wheels are stopped.
TEST_P(SerialDrive, AStopThatDoesNotArriveIsRepeatedByTheWatchdog) {
  const auto drive = open();
  expect_stop_by_timeout(plug_, [&] {
    EXPECT_TRUE(can_be_driven(*drive));
    const auto commanded = std::chrono::steady_clock::now();
    plug_.server().set_dead(true);
    static_cast<void>(drive->set_speeds({0, 0}));
    plug_.server().set_dead(false);
    // If answers are missing, the drive may have repeated the handshake, which stops the wheels sooner.
    return commanded;
  });
}

// Catches a drive that does not stop wheels which another program left turning.
TEST_P(SerialDrive, OpeningStopsWheelsThatTurn) {
  plug_.server().with([](emulator::Firmware& firmware) { firmware.wheels.set(300, 300); });
  const auto drive = open();
  plug_.server().catch_up();
  EXPECT_FALSE(plug_.server().turns());
}

TEST_P(SerialDrive, StopsWhenItIsDestroyed) {
  auto drive = open();
  ASSERT_TRUE(drive->set_speeds({5, 5}));
  drive.reset();
  EXPECT_TRUE(comes_to(false));
}

/// Starts a program that drives, in its own process.
pid_t start_program(Plug& plug) {
  int ready[2];
  EXPECT_EQ(::pipe(ready), 0);
  const pid_t program = ::fork();
  if (program == 0) {
    auto drive = open_drive(plug.settings(kCountsPerTurn), kLimits, plug.machine());
    if (!drive) ::_exit(1);
    while (true) {
      const bool driven = (*drive)->set_speeds({5, 5}).has_value();
      if (driven) static_cast<void>(!::write(ready[1], "d", 1));
      std::this_thread::sleep_for(20ms);
    }
  }
  char word = 0;
  EXPECT_EQ(::read(ready[0], &word, 1), 1);
  std::this_thread::sleep_for(100ms);
  ::close(ready[0]);
  ::close(ready[1]);
  return program;
}

void expect_stop_after(Plug& plug, int signal) {
  pid_t program = -1;
  const auto deed = [&] {
    program = start_program(plug);
    while (!plug.server().turns()) std::this_thread::sleep_for(1ms);  // on a slow machine the wheels stop in between
    const auto begun = std::chrono::steady_clock::now();
    ::kill(program, signal);
    return begun;
  };
  const auto after = [&] {
    for (const auto end = std::chrono::steady_clock::now() + kTimeout; std::chrono::steady_clock::now() < end;) {
      EXPECT_FALSE(plug.server().turns()) << "they turn again";
      std::this_thread::sleep_for(5ms);
    }
    ::kill(program, SIGKILL);
    ::waitpid(program, nullptr, 0);
    plug.unplug();
    plug.plug_in();
  };
  expect_stop_by_timeout(plug, deed, after);
}

TEST_P(SerialDrive, StopsWhenTheProgramIsKilled) { expect_stop_after(plug_, SIGKILL); }
TEST_P(SerialDrive, StopsWhenTheProgramHangs) { expect_stop_after(plug_, SIGSTOP); }

INSTANTIATE_TEST_SUITE_P(All, SerialDrive, testing::Values("ros_arduino_bridge", "roboclaw", "create2"),
                         [](const auto& tested) { return std::string(tested.param); });

/// A RoboClaw without a watchdog has only its own time-out.
TEST(WithoutWatchdog, RoboclawStopsByItsOwnTimeoutWhenTheProgramIsHalted) {
  Plug plug("roboclaw");
  SerialDriveSettings without = plug.settings(kCountsPerTurn);
  without.watchdog = false;
  const auto drive = value(open_drive(without, kLimits, plug.machine()));
  expect_stop_by_timeout(plug, [&] {
    EXPECT_TRUE(drive->set_speeds({5, 5}));
    return std::chrono::steady_clock::now();  // no more commands follow
  });
  // Questions restart the controller's time-out, so here the drive itself must keep the dead-man rule.
  expect_stop_by_timeout(plug, [&] {
    EXPECT_TRUE(drive->set_speeds({5, 5}));
    const auto commanded = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() < commanded + kTimeout + kGrace) {
      EXPECT_TRUE(drive->read_angles());
      std::this_thread::sleep_for(20ms);
    }
    return commanded;
  });
}

/// The process id of the only child of this program, its watchdog.
pid_t watchdog_of_this_program() {
  std::ifstream file("/proc/thread-self/children");
  pid_t child = -1;
  file >> child;
  return child;
}

// Catches a drive that continues without its watchdog, and a watchdog that remains as a zombie.
TEST(WithWatchdog, AWatchdogThatIsKilledStopsTheDriveAndIsReplaced) {
  Plug plug("create2");
  const auto drive = value(open_drive(plug.settings(kCountsPerTurn), kLimits, plug.machine_again()));
  ASSERT_TRUE(drive->set_speeds({5, 5}));
  const pid_t first = watchdog_of_this_program();
  ASSERT_GT(first, 0);
  for (const int harmless : {SIGHUP, SIGINT, SIGTERM, SIGALRM, SIGPIPE, SIGUSR1, SIGTSTP}) ::kill(first, harmless);
  std::this_thread::sleep_for(50ms);
  ASSERT_TRUE(drive->set_speeds({5, 5})) << "the watchdog ignores these signals";
  EXPECT_NE(::getsid(first), ::getsid(0));
  ::kill(first, SIGKILL);
  const auto end = std::chrono::steady_clock::now() + 5s;
  auto refused = drive->set_speeds({5, 5});
  while (refused && std::chrono::steady_clock::now() < end) refused = drive->set_speeds({5, 5});
  EXPECT_THAT(refused, FailsWith(ErrorCode::kUnavailable));
  plug.server().catch_up();
  EXPECT_FALSE(plug.server().turns());
  EXPECT_EQ(::kill(first, 0), -1) << "a zombie remains";
  while (!drive->set_speeds({5, 5}) && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(20ms);
  const pid_t second = watchdog_of_this_program();
  EXPECT_GT(second, 0);
  EXPECT_NE(second, first);
}

// Catches a drive that continues without a running watchdog.
TEST(WithWatchdog, AHaltedWatchdogIsNoticedInTimeAndReplaced) {
  for (int i = 0; i < kTries; ++i) {
    Plug plug("ros_arduino_bridge");
    const auto drive = value(open_drive(plug.settings(kCountsPerTurn), kLimits, plug.machine()));
    ASSERT_TRUE(drive->set_speeds({5, 5}));
    const pid_t first = watchdog_of_this_program();
    ASSERT_GT(first, 0);
    const Lateness lateness;
    ::kill(first, SIGSTOP);
    const auto halted = std::chrono::steady_clock::now();
    const auto refused = drive->set_speeds({5, 5});
    const auto noticed = std::chrono::steady_clock::now() - halted;
    EXPECT_THAT(refused, FailsWith(ErrorCode::kUnavailable,
                                   AllOf(HasSubstr("process " + std::to_string(first) + ", did not run"),
                                         HasSubstr("the wheels were stopped"))))
        << "it drives without a watchdog that could stop it";
    plug.server().catch_up();
    EXPECT_FALSE(plug.server().turns());
    EXPECT_EQ(::kill(first, 0), -1) << "it remains halted";
    EXPECT_TRUE(drive->set_speeds({5, 5})) << "another watchdog is running";
    EXPECT_NE(watchdog_of_this_program(), first);
    if (noticed <= kTimeout) return;
    ASSERT_GE(lateness.longest(), kSpoilt) << std::chrono::duration<double>(noticed).count() << " s";
  }
  FAIL() << "in " << kTries << " tries it was noticed too late, or the machine was too slow";
}

// Catches a drive that takes the answers to the watchdog's stops as its own.
TEST(WithWatchdog, AnswersToTheWatchdogsStopsAreNotTakenForTheProgramsOwn) {
  for (const char* protocol : {"ros_arduino_bridge", "roboclaw"}) {
    Plug plug(protocol);
    const auto drive = value(open_drive(plug.settings(kCountsPerTurn), {12, 100ms}, plug.machine()));
    int failed = 0, all = 0;
    // The interval between commands is about the time-out, sometimes shorter and sometimes longer.
    for (int ms = 94; ms <= 106; ms += 2) {
      const Lateness lateness;
      const auto set = drive->set_speeds({5, 5});
      const auto angles = drive->read_angles();
      if (lateness.longest() < kSpoilt) {
        ++all;
        failed += !set || !angles;
        EXPECT_TRUE(set) << protocol << ", " << ms << ": " << set.error().message;
        EXPECT_TRUE(angles) << protocol << ", " << ms << ": " << angles.error().message;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(ms));
    }
    EXPECT_EQ(failed, 0) << protocol << " of " << all;
  }
}

TEST(WithWatchdog, AWatchdogHoldsNothingButItsPortAndItsPipe) {
  Plug plug("create2");
  const auto drive = value(open_drive(plug.settings(kCountsPerTurn), kLimits, plug.machine()));
  int open = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator("/proc/" + std::to_string(watchdog_of_this_program()) + "/fd")) {
    static_cast<void>(entry);
    ++open;
  }
  EXPECT_EQ(open, 2);
}

}  // namespace
}  // namespace twocone::serial

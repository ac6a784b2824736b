// SPDX-License-Identifier: Apache-2.0
// Tests a serial drive, opened as from a robot file, in operation and with faults:
//   drive_probe PROTOCOL PORT LOG COMMANDS UNPLUG PLUG
// An emulated controller is at the other end. Its output goes to LOG and its input follows COMMANDS. UNPLUG and PLUG
// are shell commands that remove the port and bring it back.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/backends.h"
#include "hal/result.h"
#include "tests/vm/emulator_files.h"

namespace twocone::vm {
namespace {

using namespace std::chrono_literals;

constexpr double kCountsPerTurn = 508.8;
constexpr DriveLimits kLimits{12, 500ms};
constexpr WheelSpeeds kSpeeds{3, -2};
constexpr double kCycle_s = 0.04;
// Time until the emulator has read a command from its file, which another kernel may buffer.
constexpr double kObeys_s = 0.4;
// A command may take effect this much earlier or later than its time.
constexpr double kJitter_s = 0.2;
// Between two readings the emulated machine may be late by much more, which is not a jump.
constexpr double kJumpJitter_s = 0.8;

/// The results of driving for a time, with a command and a reading in each cycle.
struct Stretch {
  int calls = 0;
  std::map<std::string, int> failed;  // number of failures by code
  std::optional<WheelAngles> first, last;
  double longest_call_s = 0;
  bool jumped = false;

  [[nodiscard]] int failures() const {
    int sum = 0;
    for (const auto& [code, count] : failed) sum += count;
    return sum;
  }
  [[nodiscard]] std::string summary() const {
    std::string text = fmt::format("{} of {} calls failed", failures(), calls);
    for (const auto& [code, count] : failed) text += fmt::format(", {} {}", count, code);
    return text;
  }
  [[nodiscard]] bool only(std::initializer_list<const char*> codes) const {
    return std::all_of(failed.begin(), failed.end(), [&](const auto& entry) {
      return std::find(codes.begin(), codes.end(), entry.first) != codes.end();
    });
  }
};

class Probe {
 public:
  Probe(char** argv)
      : protocol_(argv[1]), port_(argv[2]), emulator_(argv[3], argv[4]), unplug_(argv[5]), plug_(argv[6]) {}

  int run() {
    greets();
    drives();
    for (const char* fault : {"lose", "late", "twice", "cut", "garble", "garbage"}) survives(fault);
    wraps();
    resets();
    unplugs();
    keeps_others_out();
    stops();
    return is_met_ ? 0 : 1;
  }

 private:
  drivers::DrivePart part() const {
    serial::SerialDriveSettings serial;
    serial.port = port_;
    serial.protocol = protocol_;
    serial.counts_per_turn = kCountsPerTurn;
    return {"serial_diffdrive", kLimits, serial};
  }

  bool open() {
    drive_.reset();
    auto drive = drivers::open_drive(part());
    if (!drive) {
      std::printf("open: %s: %s\n", std::string(to_string(drive.error().code)).c_str(), drive.error().message.c_str());
      return false;
    }
    drive_ = *std::move(drive);
    return true;
  }

  void check(const std::string& what, const std::string& figure, const std::string& target, bool is_met) {
    is_met_ = row(fmt::format("{}: {}", protocol_, what), figure, target, is_met) && is_met_;
  }

  template <typename T>
  bool note(Stretch& stretch, const Result<T>& result, double begun_s) {
    ++stretch.calls;
    stretch.longest_call_s = std::max(stretch.longest_call_s, now_s() - begun_s);
    if (result) return true;
    ++stretch.failed[std::string(to_string(result.error().code))];
    return false;
  }

  void cycle(Stretch& stretch) {
    double begun_s = now_s();
    note(stretch, drive_->set_speeds(kSpeeds), begun_s);
    begun_s = now_s();
    const auto angles = drive_->read_angles();
    if (note(stretch, angles, begun_s)) {
      if (stretch.last) {
        const double time_s = std::chrono::duration<double>(angles->time - stretch.last->time).count() + kJumpJitter_s;
        stretch.jumped = stretch.jumped || std::abs(angles->left_rad - stretch.last->left_rad) > 3 * time_s + 0.1 ||
                         std::abs(angles->right_rad - stretch.last->right_rad) > 2 * time_s + 0.1;
      }
      if (!stretch.first) stretch.first = *angles;
      stretch.last = *angles;
    }
    sleep_s(kCycle_s);
  }
  Stretch drive_for(double time_s) {
    Stretch stretch;
    for (const double end_s = now_s() + time_s; now_s() < end_s;) cycle(stretch);
    return stretch;
  }

  /// Largest deviation of either wheel's angle from its speed times the time.
  static double deviation_rad(const Stretch& stretch) {
    if (!stretch.first) return INFINITY;
    const double time_s = std::chrono::duration<double>(stretch.last->time - stretch.first->time).count();
    return std::max(std::abs(stretch.last->left_rad - stretch.first->left_rad - kSpeeds.left_radps * time_s),
                    std::abs(stretch.last->right_rad - stretch.first->right_rad - kSpeeds.right_radps * time_s));
  }
  // Commands of ros_arduino_bridge are whole counts per 33 ms with the right mean.
  static double tolerance_rad() { return 3 * kJitter_s + 2 * std::numbers::pi / kCountsPerTurn * 2; }

  void greets() {
    const bool opened = open();
    check("found and answering", opened ? drive_->facts().controller : "no", "an answer", opened);
    if (!opened) std::exit(1);
  }

  void drives() {
    drive_for(0.3);
    const Stretch stretch = drive_for(4);
    check("driven for 4 s", stretch.summary(), "none failed", stretch.failures() == 0);
    check("odometry against the clock, 4 s at 3 and -2 rad/s", fmt::format("{:.3f} rad apart", deviation_rad(stretch)),
          fmt::format("<= {:.2f} rad", tolerance_rad()), deviation_rad(stretch) <= tolerance_rad());
  }

  void survives(const std::string& fault) {
    drive_for(0.3);
    const WheelAngles before = must_read();
    emulator_.send(fault == "garbage" ? "garbage 60" : fault + " 2");
    Stretch stretch = drive_for(kObeys_s + 1.5);
    const Stretch after = drive_for(0.5);
    const bool continues = after.failures() == 0 && emulator_.turns();
    const bool is_odometry_right = !stretch.jumped && after.last && after.last->left_rad > before.left_rad + 3;
    check(fmt::format("answers disturbed while driving ({})", fault),
          fmt::format("{}; {}", stretch.summary(), continues ? "continues" : "does not continue: " + after.summary()),
          "Timeout or BadData, no jump, continues",
          stretch.only({"Timeout", "BadData", "Refused"}) && continues && is_odometry_right);
  }

  WheelAngles must_read() {
    const auto angles = drive_->read_angles();
    return angles ? *angles : WheelAngles{};
  }

  void wraps() {
    drive_.reset();
    const double near = protocol_ == "create2" ? 65535 - 200 : 2147483647.0 - 200;
    emulator_.send(fmt::format("counts {:.0f} {:.0f}", near, protocol_ == "create2" ? 100 : -near));
    sleep_s(kObeys_s);
    if (!open()) return check("counters that wrap", "not opened", "no jump", false);
    drive_for(0.3);
    const Stretch stretch = drive_for(3);
    check("counters that wrap while driving",
          fmt::format("{}; {:.3f} rad apart", stretch.summary(), deviation_rad(stretch)), "none failed, no jump",
          stretch.failures() == 0 && !stretch.jumped && deviation_rad(stretch) <= tolerance_rad());
  }

  /// Commands and reads until the drive works again; returns whether it does in that time.
  bool comes_back(double within_s) {
    return comes_true(within_s, [&] { return drive_->set_speeds(kSpeeds) && drive_->read_angles(); });
  }

  void resets() {
    drive_for(0.5);
    emulator_.send("counts 25000 25000");  // this is a jump too, like the counts after a reset of the board
    drive_for(kObeys_s + 0.5);
    if (!comes_back(8)) return check("reset of the board", "does not come back", "no jump", false);
    const WheelAngles before = must_read();
    const double reset_s = now_s();
    emulator_.send("reset");
    const Stretch stretch = drive_for(kObeys_s + 1.5);
    const bool is_back = comes_back(8);
    const WheelAngles after = must_read();
    const double most_rad = 3 * (now_s() - reset_s + kJitter_s);
    const double moved_rad = after.left_rad - before.left_rad;
    check("reset of the board while driving", fmt::format("{}; odometry {:+.2f} rad", stretch.summary(), moved_rad),
          "reported as Disconnected, continues, no jump",
          is_back && stretch.failed.contains("Disconnected") && moved_rad >= -0.1 && moved_rad <= most_rad);
  }

  void unplugs() {
    comes_back(8);
    drive_for(0.5);
    const WheelAngles before = must_read();
    const double unplugged_s = now_s();
    std::thread unplugging([this] { static_cast<void>(std::system(unplug_.c_str())); });
    Stretch stretch;
    while (!stretch.failed.contains("Disconnected") && now_s() < unplugged_s + 10) cycle(stretch);
    const double reported_s = now_s() - unplugged_s;
    unplugging.join();
    const bool is_reported = stretch.failed.contains("Disconnected");
    check(
        "unplugged while driving",
        fmt::format("{} after {:.2f} s; {}", is_reported ? "Disconnected" : "no report", reported_s, stretch.summary()),
        "Disconnected within 1 s",
        is_reported && reported_s <= 1 && stretch.only({"Disconnected", "Timeout", "BadData"}));
    const Stretch away = drive_for(1.5);
    const bool all_failed = away.failures() == away.calls && away.only({"Disconnected"});
    check("while it is unplugged", fmt::format("{}, longest {:.2f} s", away.summary(), away.longest_call_s),
          "all Disconnected, none over 0.5 s", all_failed && away.longest_call_s <= 0.5);
    sleep_s(3);  // for the time-outs of controllers that have one
    const bool turns = emulator_.turns();
    const bool may_turn = protocol_ == "create2";
    check("wheels while the port is unplugged", turns ? "turning" : "stopped",
          may_turn ? "turning: this controller has no time-out" : "stopped by the controller's own time-out",
          turns == may_turn);
    comes_back_plugged_in(before, reported_s);
  }

  void comes_back_plugged_in(const WheelAngles& before, double reported_s) {
    const std::size_t changes = emulator_.changes().size();
    static_cast<void>(std::system(plug_.c_str()));
    const double plugged_s = now_s();
    const bool is_back = comes_back(20);
    const double back_s = now_s() - plugged_s;
    const double moved_rad = must_read().left_rad - before.left_rad;
    const double most_rad = 3 * (reported_s + kLimitsTimeout_s + kJitter_s) + 1;
    check("plugged in again",
          fmt::format("{} after {:.1f} s, odometry {:+.2f} rad", is_back ? "drives" : "no answer", back_s, moved_rad),
          "drives, no jump", is_back && moved_rad >= 0 && moved_rad <= most_rad);
    sleep_s(kObeys_s);
    const auto all = emulator_.changes();
    const bool stopped = std::any_of(all.begin() + std::ptrdiff_t(std::min(changes, all.size())), all.end(),
                                     [](const auto& change) { return !change.turns; });
    if (protocol_ == "create2") {
      check("wheels that still turned, when the port came back", stopped ? "stopped first" : "not stopped",
            "stopped first", stopped);
    }
  }

  void keeps_others_out() {
    drive_for(0.3);
    Stretch stretch = drive_for(0.3);
    std::string other;
    std::thread second([&] {
      const auto drive = drivers::open_drive(part());
      other = drive ? "opened" : std::string(to_string(drive.error().code)) + ": " + drive.error().message;
    });
    stretch = drive_for(1.5);
    second.join();
    check("a second program on the same port", fmt::format("{}; the first: {}", other, stretch.summary()),
          "Refused, and the first continues", other.rfind("Refused", 0) == 0 && stretch.failures() == 0);
  }

  void stops() {
    drive_for(0.3);
    const bool stopped = drive_->stop().has_value();
    const bool stands = comes_true(3, [&] { return !emulator_.turns(); });
    drive_for(0.3);
    const bool turned = comes_true(3, [&] { return emulator_.turns(); });
    drive_.reset();
    const bool stands_again = comes_true(3, [&] { return !emulator_.turns(); });
    check("wheels after stop, and when the drive is destroyed",
          fmt::format("{}, {}", stands ? "stopped" : "turning", stands_again ? "stopped" : "turning"), "stopped",
          stopped && stands && turned && stands_again);
  }

  static constexpr double kLimitsTimeout_s = 0.5;
  const std::string protocol_, port_;
  const EmulatedFiles emulator_;
  const std::string unplug_, plug_;
  std::unique_ptr<DiffDrive> drive_;
  bool is_met_ = true;
};

}  // namespace
}  // namespace twocone::vm

int main(int argc, char** argv) {
  if (argc != 7) {
    std::fputs("usage: drive_probe PROTOCOL PORT LOG COMMANDS UNPLUG PLUG\n", stderr);
    return 2;
  }
  return twocone::vm::Probe(argv).run();
}

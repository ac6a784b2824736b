// SPDX-License-Identifier: Apache-2.0
// Disturbs a program that drives, at random moments, and reads from the emulator's log when its wheels stop:
//   stop_trial PROTOCOL DEED COUNT SEED TIMEOUT_S LOG COMMAND...
// DEED: kill (-9), halt (SIGSTOP), unplug (both cameras of vivid), watchdog (kill -9 of the program and its watchdog at
// the same time). COMMAND is started again for each trial. TIMEOUT_S is the robot file's command_timeout_s. Both ends
// of the serial port are in this machine, so the log's times are those of this program's clock.
#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <optional>
#include <random>

#include <fmt/format.h>

#include "tests/vm/emulator_files.h"

namespace twocone::vm {
namespace {

constexpr double kStarts_s = 120;  // the emulated machine is slow
constexpr double kGrace_s = 0.1;
// Time after the limit in which the wheels must not turn again.
constexpr double kWatched_s = 1.5;
constexpr double kMostWait_s = 3;
constexpr const char* kVivid = "/sys/bus/platform/drivers/vivid/";

void write_to(const std::string& path, const std::string& text) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0 || ::write(file, text.data(), text.size()) < 0) std::perror(path.c_str());
  if (file >= 0) ::close(file);
}

/// A file of /proc/PID.
std::string proc(pid_t process, const char* name) {
  std::ifstream file(fmt::format("/proc/{}/{}", process, name));
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<pid_t> watchdogs() {
  std::vector<pid_t> found;
  DIR* folder = ::opendir("/proc");
  while (const dirent* entry = ::readdir(folder)) {
    if (std::isdigit(static_cast<unsigned char>(entry->d_name[0])) == 0) continue;
    const pid_t process = std::atoi(entry->d_name);
    if (proc(process, "comm") == "twocone-watchdog\n") found.push_back(process);
  }
  ::closedir(folder);
  return found;
}

class Trials {
 public:
  Trials(std::string deed, double timeout_s, const std::string& log, std::vector<std::string> command, unsigned seed)
      : deed_(std::move(deed)),
        timeout_s_(timeout_s),
        emulator_(log, ""),
        command_(std::move(command)),
        random_(seed) {}

  struct Outcome {
    /// The time after the deed at which the wheels finally stopped; nothing if they turned to the end.
    std::optional<double> stopped_after_s;
    std::string course;  ///< starts and stops of the wheels since the deed, for a person
  };
  Outcome one() {
    while (true) {
      start();
      const double done_s = wait_and_do();
      sleep_s(std::max(timeout_s_ + kGrace_s, deed_ == "watchdog" ? 2.0 : 0.0) + kWatched_s);
      const auto outcome = look_back(done_s);
      clean_up();
      if (outcome) return *outcome;
      std::puts("the wheels were stopped at that moment: tried again");
    }
  }

 private:
  void start() {
    const double begun_s = now_s();
    program_ = ::fork();
    if (program_ == 0) become_program();
    const bool began = comes_true(kStarts_s, [&] {
      const auto all = emulator_.changes();
      return !all.empty() && all.back().turns && all.back().time_s > begun_s;
    });
    if (began) return;
    std::printf("the program does not drive within %.0f s\n", kStarts_s);
    clean_up();
    std::exit(1);
  }

  [[noreturn]] void become_program() {
    ::setpgid(0, 0);
    std::vector<char*> words;
    for (auto& word : command_) words.push_back(word.data());
    words.push_back(nullptr);
    ::execv(words[0], words.data());
    std::perror(words[0]);
    ::_exit(127);
  }

  /// Waits, does the deed and returns the time at which it began.
  double wait_and_do() {
    sleep_s(kMostWait_s * std::ldexp(double(random_()), -32));
    comes_true(kStarts_s, [&] { return emulator_.turns(); });
    const double begun_s = now_s();
    if (deed_ == "kill") ::kill(program_, SIGKILL);
    if (deed_ == "halt") ::kill(program_, SIGSTOP);
    if (deed_ == "unplug") write_to(std::string(kVivid) + "unbind", "vivid.0");
    if (deed_ == "watchdog") {
      ::kill(program_, SIGSTOP);  // otherwise it would notice that its watchdog is gone
      for (const pid_t watchdog : watchdogs()) ::kill(watchdog, SIGKILL);
      ::kill(program_, SIGKILL);
    }
    return begun_s;
  }

  [[nodiscard]] std::optional<Outcome> look_back(double done_s) const {
    bool turned = false;
    Outcome outcome;
    for (const auto& change : emulator_.changes()) {
      if (change.time_s < done_s) {
        turned = change.turns;
        continue;
      }
      const double after_s = change.time_s - done_s;
      outcome.course += fmt::format(" {} {:.3f} s", change.turns ? "turn" : "stop", after_s);
      outcome.stopped_after_s = change.turns ? std::nullopt : std::optional(after_s);
    }
    if (!turned) return std::nullopt;
    return outcome;
  }

  void clean_up() {
    ::kill(program_, SIGKILL);
    ::waitpid(program_, nullptr, 0);
    if (!comes_true(10, [] { return watchdogs().empty(); })) std::puts("a watchdog outlives its program");
    if (deed_ != "unplug") return;
    write_to(std::string(kVivid) + "bind", "vivid.0");
    comes_true(30, [] { return ::access("/dev/video0", R_OK) == 0 && ::access("/dev/video1", R_OK) == 0; });
  }

  const std::string deed_;
  const double timeout_s_;
  const EmulatedFiles emulator_;
  std::vector<std::string> command_;
  std::mt19937 random_;
  pid_t program_ = -1;
};

std::string name_of(const std::string& deed) {
  if (deed == "kill") return "kill -9 of the program";
  if (deed == "halt") return "SIGSTOP of the program";
  if (deed == "unplug") return "unplugging the cameras";
  return "kill -9 of program and watchdog at once";
}

/// The controller's own time-out, which stops the wheels if the watchdog is killed too; nothing: it has none.
std::optional<double> own_timeout_s(const std::string& protocol, double timeout_s) {
  if (protocol == "roboclaw") return timeout_s;
  if (protocol == "ros_arduino_bridge") return 2.0;
  return std::nullopt;
}

int run(int argc, char** argv) {
  const std::string protocol = argv[1], deed = argv[2];
  const int count = std::atoi(argv[3]);
  const double timeout_s = std::atof(argv[5]);
  Trials trials(deed, timeout_s, argv[6], std::vector<std::string>(argv + 7, argv + argc),
                unsigned(std::atoi(argv[4])));
  const auto limit_s = deed == "watchdog" ? own_timeout_s(protocol, timeout_s) : timeout_s;
  int good = 0;
  double longest_s = 0;
  for (int i = 1; i <= count; ++i) {
    const auto outcome = trials.one();
    const auto after_s = outcome.stopped_after_s;
    std::printf("%s, %s, %d:%s\n", protocol.c_str(), deed.c_str(), i,
                outcome.course.empty() ? " turn to the end" : outcome.course.c_str());
    std::fflush(stdout);
    if (after_s) longest_s = std::max(longest_s, *after_s);
    const bool is_met = limit_s ? after_s && *after_s <= *limit_s + kGrace_s : !after_s;
    good += is_met;
  }
  const std::string what =
      fmt::format("{}: wheels stopped after {}, from {} random moments of driving", protocol, name_of(deed), count);
  if (!limit_s) {
    return row(what, fmt::format("never, {} of {}", good, count), "never: it has no time-out of its own", good == count)
               ? 0
               : 1;
  }
  return row(what, fmt::format("{} of {}, longest {:.3f} s", good, count, longest_s),
             fmt::format("all within {:.1f} s{}, and no turn after", *limit_s + kGrace_s,
                         deed == "watchdog" ? ", by its own time-out" : ""),
             good == count)
             ? 0
             : 1;
}

}  // namespace
}  // namespace twocone::vm

int main(int argc, char** argv) {
  if (argc < 8) {
    std::fputs("usage: stop_trial PROTOCOL kill|halt|unplug|watchdog COUNT SEED TIMEOUT_S LOG COMMAND...\n", stderr);
    return 2;
  }
  return twocone::vm::run(argc, argv);
}

// SPDX-License-Identifier: Apache-2.0
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "apps/doctor/doctor.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"
#include "drivers/backends.h"

namespace twocone::cli {
namespace {

// ---- devices

constexpr std::size_t kLine = 118;

bool is_serial(const DeviceInfo& device) { return device.driver == drivers::kSerialDiffDrive; }

bool is_forbidden(const std::string& path) {
  return path.starts_with('/') && ::access(path.c_str(), R_OK | W_OK) != 0 && errno == EACCES;
}

/// Returns the cameras that the user has no permission to open. They are missing from the list of devices.
std::vector<std::string> forbidden_cameras() {
  std::vector<std::string> paths;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", none)) {
    if (entry.path().filename().string().starts_with("video") && is_forbidden(entry.path())) {
      paths.push_back(entry.path());
    }
  }
  std::ranges::sort(paths);
  return paths;
}

/// Prints modes such as "YUYV 640x480 at 30 Hz" by their first word. The sizes of one format share lines.
void print_modes(const std::vector<std::string>& modes) {
  std::string line;
  std::string format;
  const auto flush = [&line] {
    if (!line.empty()) fmt::print("    {}\n", line);
    line.clear();
  };
  for (const std::string& mode : modes) {
    const std::size_t space = mode.find(' ');
    const std::string name = mode.substr(0, space);
    const std::string remainder = space == std::string::npos ? "" : mode.substr(space + 1);
    if (name != format || line.size() + remainder.size() + 6 > kLine) {
      flush();
      line = fmt::format("{:4}  {}", name, remainder);
    } else {
      line += "; " + remainder;
    }
    format = name;
  }
  flush();
}

void print_device(const DeviceInfo& device) {
  fmt::print("{}\n  driver: {}\n  {}: {}\n", device.what, device.driver, is_serial(device) ? "port" : "device",
             device.name);
  if (is_serial(device) && is_forbidden(device.name)) {
    fmt::print("  it may not be opened: sudo usermod -aG dialout $USER, then log in again\n");
  }
  std::vector<std::string> known;
  std::string unknown;
  for (const std::string& detail : device.details) {
    const std::size_t at = detail.find(" (not known to this driver)");
    if (at == std::string::npos) {
      known.push_back(detail);
    } else {
      unknown += " " + detail.substr(0, at);
    }
  }
  if (!known.empty()) fmt::print("  formats, sizes, rates:\n");
  print_modes(known);
  if (!unknown.empty()) fmt::print("  formats without use here:{}\n", unknown.size() > kLine ? " many" : unknown);
  fmt::print("\n");
}

void print_devices() {
  const drivers::Devices devices = drivers::list_devices();
  for (const DeviceInfo& device : devices.found) print_device(device);
  for (const std::string& path : forbidden_cameras()) {
    fmt::print("{} may not be opened: sudo usermod -aG video $USER, then log in again\n", path);
  }
  if (devices.found.empty()) {
    fmt::print(
        "no camera and no serial port was found: are they plugged in, and do they have power? Permission: the groups\n"
        "video (cameras) and dialout (serial ports); `id` prints yours. dmesg prints the kernel's messages.\n");
  }
  for (const std::string& why : devices.not_looked_for) fmt::print("not looked for: {}\n", why);
}

// ---- doctor

struct DoctorArguments {
  RobotArgument robot;
  doctor::Options doctor;
};

// Without an answer for this time, the user is assumed to be away.
constexpr std::chrono::minutes kAnswerTime{10};
constexpr int kLook_ms = 100;

/// Returns a line of the terminal without spaces at its ends. Returns nothing at the end of input, after a signal, or
/// without an answer in time.
std::optional<std::string> read_answer(const std::atomic<bool>& stop) {
  const auto until = std::chrono::steady_clock::now() + kAnswerTime;
  std::string line;
  while (!stop && std::chrono::steady_clock::now() < until) {
    pollfd entry{STDIN_FILENO, POLLIN, 0};
    if (::poll(&entry, 1, kLook_ms) <= 0) continue;
    char letter = 0;
    if (::read(STDIN_FILENO, &letter, 1) <= 0) return std::nullopt;
    if (letter == '\n') {
      const std::size_t first = line.find_first_not_of(" \t\r");
      return first == std::string::npos ? "" : line.substr(first, line.find_last_not_of(" \t\r") + 1 - first);
    }
    line += letter;
  }
  return std::nullopt;
}

/// Asks questions on stderr, because the table goes to stdout.
class Terminal {
 public:
  std::optional<std::string> ask(const std::string& question, const std::atomic<bool>& stop) {
    bar_.reset();
    // Text that was typed before the question is no answer to it.
    ::tcflush(STDIN_FILENO, TCIFLUSH);
    std::fputs(question.c_str(), stderr);
    return read_answer(stop);
  }
  void show(const std::string& what, double share) {
    if (!bar_ || what != what_) {
      bar_.emplace(what);
      what_ = what;
    }
    bar_->show(share);
  }

 private:
  std::optional<ProgressBar> bar_;
  std::string what_;
};

void doctor_with(DoctorArguments options) {
  const config::Robot robot = options.robot.read();
  if (options.doctor.images.empty()) options.doctor.images = fmt::format("runs/doctor-{}", robot.name);
  const std::atomic<bool>& stop = stop_on_signals();
  const SteadyClock clock;
  doctor::Report report;
  {
    Terminal terminal;
    doctor::Surroundings surroundings{
        .clock = clock,
        .sleep = [](std::chrono::nanoseconds time) { std::this_thread::sleep_for(time); },
        .progress = [&terminal](const std::string& what, double share) { terminal.show(what, share); },
        .stop = stop};
    if (::isatty(STDIN_FILENO) == 1) {
      surroundings.ask = [&](const std::string& question) { return terminal.ask(question, stop); };
    }
    report = doctor::examine(robot, options.doctor, {}, surroundings);
  }
  const std::string verdict = doctor::summary(report);
  fmt::print("{}\n{}\n", doctor::table(report), verdict);
  std::fflush(stdout);
  if (report.has_failed())
    throw CommandFailed("{}: a part failed; the table names what to do", options.robot.file.string());
}

}  // namespace

void add_devices(CLI::App& program) {
  CLI::App* command =
      program.add_subcommand("devices", "List cameras and serial ports of this machine, by the names for robot files");
  command->callback([] { print_devices(); });
}

void add_doctor(CLI::App& program) {
  auto options = std::make_shared<DoctorArguments>();
  CLI::App* command = program.add_subcommand(
      "doctor", "Check a robot part by part: cameras, pair, drive, stop time; print faults and what to do");
  add_robot(command, options->robot, "Robot file (robots/lab_sim.yaml)")->required();
  add_checked(command, "--seconds", options->doctor.seconds, "Time for which each camera, and the pair, is measured",
              number_within(0.5, 3600));
  command->add_option("--images", options->doctor.images,
                      "Folder for an image of each camera with circles on rim and tip (default: runs/doctor-ROBOT)");
  command->add_flag("--wheels-off-the-ground", options->doctor.wheels_off_the_ground,
                    "Confirms that both wheels hang free: turn them without a question. Otherwise the program asks on\n"
                    "the terminal; without a terminal it never turns the wheels");
  command->footer("Exit status: 0 nothing failed, 1 something did, 2 bad usage.");
  command->callback([options] { doctor_with(*options); });
}

}  // namespace twocone::cli

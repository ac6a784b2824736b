// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "apps/twocone/commands.h"
#include "drivers/backends.h"

namespace twocone::cli {
namespace {

constexpr std::size_t kLine = 118;

bool is_serial(const DeviceInfo& device) { return device.driver == drivers::kSerialDiffDrive; }

bool is_forbidden(const std::string& path) {
  return path.starts_with('/') && ::access(path.c_str(), R_OK | W_OK) != 0 && errno == EACCES;
}

/// Returns cameras that may not be opened. They are in no list.
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

}  // namespace

void add_devices(CLI::App& program) {
  CLI::App* command =
      program.add_subcommand("devices", "List cameras and serial ports of this machine, by the names for robot files");
  command->callback([] { print_devices(); });
}

}  // namespace twocone::cli

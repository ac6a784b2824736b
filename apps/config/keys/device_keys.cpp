// SPDX-License-Identifier: Apache-2.0
#include "apps/config/keys/robot_keys.h"

#include <algorithm>
#include <cmath>

#include <fmt/ranges.h>

#include "drivers/serial_diffdrive/protocol.h"

namespace twocone::config {
namespace {

constexpr Range kBaudRange{.least = 300, .greatest = 4'000'000};
constexpr Range kAddressRange{.least = 128, .greatest = 135};
constexpr double kLeastOwnTimeout_s = 0.1;

void refuse(Section& section, std::initializer_list<std::string_view> keys, const std::string& driver) {
  const auto there = section.keys();  // has() is not used, because it would mark an unsupported key as known
  for (const std::string_view key : keys) {
    if (std::ranges::find(there, key) == there.end()) continue;
    section.complain(key, kNoUnit, fmt::format("absent: driver {} has no such setting", driver));
  }
}

void read_controls(Section& controls, bool whole, CameraDevice& device) {
  for (const std::string& name : controls.keys()) {
    double value = 0;
    if (!controls.number(name, {"value of a control", kNoUnit, kAnyNumber}, value)) continue;
    if (whole && value != std::floor(value)) {
      controls.complain(name, kNoUnit, "a whole number: the kernel's controls have no other");
      continue;
    }
    device.controls.emplace_back(name, value);
  }
}

}  // namespace

void read_camera_device(Section& section, drivers::CameraPart& camera) {
  using Keys = drivers::Backend::Keys;
  const drivers::Backend* const driver = drivers::find_backend(camera.driver);
  const bool has_integers = driver != nullptr && driver->keys == Keys::kCameraWithIntegers;
  if (!has_integers && (driver == nullptr || driver->keys != Keys::kCamera)) {
    refuse(section, {"device", "format", "controls"}, camera.driver);
    return;
  }
  section.text("device", "name of the camera; twocone devices lists the cameras", camera.device.name);
  section.text("format", "format of its pixels", camera.device.format, Need::kOptional);
  if (Section* controls = section.section("controls", "the camera's own settings, by their names", Need::kOptional)) {
    read_controls(*controls, has_integers, camera.device);
  }
}

void read_serial_drive(Section& section, Drive& drive) {
  const drivers::Backend* const driver = drivers::find_backend(drive.driver);
  if (driver == nullptr || driver->keys != drivers::Backend::Keys::kSerialDrive) {
    refuse(section,
           {"protocol", "port", "baud", "counts_per_turn", "address", "swap_wheels", "reverse_left", "reverse_right",
            "watchdog", "least_speed_radps"},
           drive.driver);
    return;
  }
  serial::SerialDriveSettings& serial = drive.serial.emplace();
  section.text("port", "name of the serial port; twocone devices lists the ports", serial.port);
  const bool has_protocol = section.text("protocol", "protocol of the controller", serial.protocol);
  const auto& names = serial::kProtocolNames;
  const bool is_known = std::ranges::find(names, serial.protocol) != names.end();
  if (has_protocol && !is_known)
    section.complain("protocol", kNoUnit, fmt::format("one of {}", fmt::join(names, ", ")));

  section.whole("baud", {"bits a second on the line", kNoUnit, kBaudRange}, serial.baud);
  const bool fixed = is_known && serial::make_protocol({.name = serial.protocol})->fixed_counts_per_turn().has_value();
  const Quantity per_turn{"encoder counts in one turn of a wheel", kNoUnit, kAboveZero};
  section.number("counts_per_turn", per_turn, serial.counts_per_turn);
  if (is_known && !fixed && !section.has("counts_per_turn")) {
    section.complain_missing("counts_per_turn", per_turn.what);
  }
  const bool has_address = section.has("address");
  section.whole("address", {"address of a RoboClaw", kNoUnit, kAddressRange}, serial.address, Need::kOptional);
  if (has_address && is_known && serial.protocol != "roboclaw") {
    section.complain("address", kNoUnit, fmt::format("absent: protocol {} has none", serial.protocol));
  }
  section.flag("swap_wheels", "whether the first motor is the right wheel's", serial.swap_wheels, Need::kOptional);
  section.flag("reverse_left", "whether the left wheel counts backward", serial.reverse_left, Need::kOptional);
  section.flag("reverse_right", "whether the right wheel counts backward", serial.reverse_right, Need::kOptional);
  section.flag("watchdog", "whether a separate process stops the wheels when the program cannot", serial.watchdog,
               Need::kOptional);
  const Quantity least_speed{
      "least speed at which the controller turns a wheel", {"rad/s", "radians a second"}, kZeroOrMore};
  section.number("least_speed_radps", least_speed, serial.least_speed_radps);
  if (!serial.watchdog && is_known && serial.protocol != "roboclaw") {
    section.complain(
        "watchdog", kNoUnit,
        fmt::format("true: a controller of protocol {} does not stop the wheels by itself in time", serial.protocol));
  }
  if (!serial.watchdog && serial.protocol == "roboclaw" && drive.command_timeout_s < kLeastOwnTimeout_s) {
    section.complain("watchdog", kNoUnit,
                     fmt::format("true: a RoboClaw's own time-out is {} s at least, longer than command_timeout_s",
                                 kLeastOwnTimeout_s));
  }
}

}  // namespace twocone::config

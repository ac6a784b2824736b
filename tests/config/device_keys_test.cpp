// SPDX-License-Identifier: Apache-2.0
// Checks the keys of real devices: each is read, each is rejected with a wrong value, and each where it is forbidden.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/robot_file.h"
#include "tests/config/fixtures.h"

namespace twocone::config {
namespace {

using testing::HasSubstr;

constexpr const char* kDrive = R"(drive:
  driver: serial_diffdrive
  port: /dev/serial/by-id/usb-motor
  protocol: roboclaw
  baud: 115200
  counts_per_turn: 979.62
  address: 131
  swap_wheels: true
  reverse_left: true
  reverse_right: true
  watchdog: false
  least_speed_radps: 0.37
  wheel_separation_m: 0.29
  wheel_radius_m: 0.043
  max_speed_mps: 0.37
  command_timeout_s: 0.41
cameras:
  lower: {driver: v4l2_camera, device: "USB Camera", format: YUYV, width_px: 641, height_px: 479, rate_hz: 12.5,
          controls: {gain: 17, exposure_time_absolute: 156}}
  upper: {driver: libcamera_camera, device: imx219, width_px: 322, height_px: 243, rate_hz: 12.5,
          controls: {AnalogueGain: 1.5}}
rig:
  mirror: {type: cone, apex_rad: 1.5708}
  mirror_radius_m: 0.061
  lens_to_tip_m: 0.118
  mirror_separation_m: 0.307
  lens_height_m: 0.23
  lower: {centre_px: [318.25, 241.5], rim_radius_px: 233.75, azimuth_rad: 0.021}
  upper: {centre_px: [160.5, 120.75], rim_radius_px: 117.5, azimuth_rad: -0.034}
)";

std::string text_with_devices() {
  return std::string("name: nina\nmap: rooms/cellar.map.yaml\nbody: {radius_m: 0.17}\n") + kDrive;
}
std::string complaint_of(const std::string& text) {
  return message_of([&] { (void)parsed_robot(text); });
}

TEST(DeviceKeys, EveryKeyOfASerialDriveIsRead) {
  const Drive drive = parsed_robot(text_with_devices()).drive;
  ASSERT_TRUE(drive.serial);
  serial::SerialDriveSettings wanted;
  wanted.port = "/dev/serial/by-id/usb-motor";
  wanted.protocol = "roboclaw";
  wanted.baud = 115200;
  wanted.counts_per_turn = 979.62;
  wanted.address = 131;
  wanted.swap_wheels = wanted.reverse_left = wanted.reverse_right = true;
  wanted.watchdog = false;
  wanted.least_speed_radps = 0.37;
  EXPECT_EQ(*drive.serial, wanted);
}

TEST(DeviceKeys, OptionalKeysHaveTheirDefaults) {
  std::string text = text_with_devices();
  for (const char* line : {"  baud: 115200\n", "  address: 131\n", "  swap_wheels: true\n", "  reverse_left: true\n",
                           "  reverse_right: true\n", "  watchdog: false\n", "  least_speed_radps: 0.37\n"}) {
    text = with(text, line, "");
  }
  const auto serial = parsed_robot(text).drive.serial;
  ASSERT_TRUE(serial);
  EXPECT_FALSE(serial->baud);
  EXPECT_FALSE(serial->least_speed_radps);
  EXPECT_EQ(serial->address, 0x80);
  EXPECT_FALSE(serial->swap_wheels || serial->reverse_left || serial->reverse_right);
  EXPECT_TRUE(serial->watchdog) << "the watchdog is on unless the file switches it off";
  // Create 2 has a fixed number of counts per turn.
  text = with(with(text, "roboclaw", "create2"), "  counts_per_turn: 979.62\n", "");
  EXPECT_FALSE(parsed_robot(text).drive.serial->counts_per_turn);
}

TEST(DeviceKeys, EveryKeyOfACameraIsRead) {
  const Robot robot = parsed_robot(text_with_devices());
  EXPECT_EQ(robot.lower.device.name, "USB Camera");
  EXPECT_EQ(robot.lower.device.format, "YUYV");
  EXPECT_THAT(robot.lower.device.controls,
              testing::ElementsAre(testing::Pair("gain", 17), testing::Pair("exposure_time_absolute", 156)));
  EXPECT_EQ(robot.upper.device.name, "imx219");
  EXPECT_EQ(robot.upper.device.format, "");
  EXPECT_THAT(robot.upper.device.controls, testing::ElementsAre(testing::Pair("AnalogueGain", 1.5)));
}

class DeviceKeysRefuse : public testing::TestWithParam<BadCase> {};

TEST_P(DeviceKeysRefuse, InOneLine) {
  const BadCase& bad = GetParam();
  const std::string message = complaint_of(with(text_with_devices(), bad.find, bad.replace));
  EXPECT_THAT(message, HasSubstr(bad.message));
  EXPECT_EQ(message.rfind("robot.yaml:", 0), 0u) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

const BadCase kBadDeviceKeys[] = {
    {"NoPort", "  port: /dev/serial/by-id/usb-motor\n", "", "drive.port is missing"},
    {"EmptyPort", "/dev/serial/by-id/usb-motor", "''", "drive.port"},
    {"NoProtocol", "  protocol: roboclaw\n", "", "drive.protocol is missing"},
    {"OtherProtocol", "roboclaw", "telepathy", "one of ros_arduino_bridge, roboclaw, create2"},
    {"NoCounts", "  counts_per_turn: 979.62\n", "", "drive.counts_per_turn is missing"},
    {"ZeroCounts", "979.62", "0", "drive.counts_per_turn is 0"},
    {"InfiniteCounts", "979.62", ".inf", "drive.counts_per_turn"},
    {"SlowBaud", "115200", "299", "drive.baud is 299"},
    {"FractionalBaud", "115200", "9600.5", "drive.baud"},
    {"LowAddress", "131", "127", "drive.address is 127"},
    {"HighAddress", "131", "136", "drive.address is 136"},
    {"WordForSwap", "swap_wheels: true", "swap_wheels: maybe", "drive.swap_wheels"},
    {"WordForLeft", "reverse_left: true", "reverse_left: 2", "drive.reverse_left"},
    {"WordForRight", "reverse_right: true", "reverse_right: [1]", "drive.reverse_right"},
    {"WordForWatchdog", "watchdog: false", "watchdog: sometimes", "drive.watchdog"},
    {"WatchdogOffInTooShortATime", "command_timeout_s: 0.41", "command_timeout_s: 0.09",
     "drive.watchdog is 'false', must be true: a RoboClaw's own time-out is 0.1 s at least"},
    {"LeastSpeedBelowZero", "least_speed_radps: 0.37", "least_speed_radps: -1", "drive.least_speed_radps"},
    {"UnknownKey", "  watchdog: false\n", "  watchdog: false\n  parity: even\n", "drive.parity"},
    {"NoDevice", "device: \"USB Camera\", ", "", "cameras.lower.device is missing"},
    {"FractionalControl", "gain: 17", "gain: 17.5", "a whole number"},
    {"WordForControl", "AnalogueGain: 1.5", "AnalogueGain: high", "cameras.upper.controls.AnalogueGain"},
    {"ControlsThatAreNone", "controls: {AnalogueGain: 1.5}", "controls: 3", "cameras.upper.controls"}};

INSTANTIATE_TEST_SUITE_P(All, DeviceKeysRefuse, testing::ValuesIn(kBadDeviceKeys), name_of<BadCase>);

// A robot file that would let wheels turn for ever is rejected.
TEST(DeviceKeys, TheWatchdogMayNotBeOffWhereTheControllerDoesNotStopInTime) {
  for (const char* protocol : {"ros_arduino_bridge", "create2"}) {
    std::string text = with(with(text_with_devices(), "roboclaw", protocol), "  address: 131\n", "");
    EXPECT_THAT(complaint_of(text), HasSubstr(fmt::format("drive.watchdog is 'false', must be true: a controller of "
                                                          "protocol {} does not stop the wheels by itself in time",
                                                          protocol)));
    text = with(text, "watchdog: false", "watchdog: true");
    EXPECT_EQ(complaint_of(text), "no error");
  }
}

TEST(DeviceKeys, AnAddressIsARoboClaws) {
  const std::string text = with(with(text_with_devices(), "roboclaw", "create2"), "watchdog: false", "watchdog: true");
  EXPECT_THAT(complaint_of(text), HasSubstr("drive.address is 131, must be absent: protocol create2 has none"));
}

TEST(DeviceKeys, ASimulatedDriveHasNoSuchKeys) {
  const std::string text = read_text(data("good_robot.yaml"));
  for (const char* key :
       {"protocol: roboclaw", "port: /dev/ttyUSB0", "baud: 9600", "counts_per_turn: 100", "address: 128",
        "swap_wheels: true", "reverse_left: true", "reverse_right: true", "watchdog: true"}) {
    const std::string message =
        complaint_of(with(text, "  wheel_separation_m", fmt::format("  {}\n  wheel_separation_m", key)));
    EXPECT_THAT(message, HasSubstr("absent: driver sim_povray has no such setting")) << key;
  }
}

}  // namespace
}  // namespace twocone::config

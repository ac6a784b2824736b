// SPDX-License-Identifier: Apache-2.0
// What the settings of a drive and its opening refuse, and in which words. These tests measure no time.
#include <algorithm>
#include <chrono>
#include <memory>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/serial_diffdrive/serial_diffdrive.h"
#include "tests/emulator/plug.h"
#include "tests/support/error_of.h"
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

constexpr double kOpeningCountsPerTurn = 508.8;
constexpr DriveLimits kOpeningLimits{12, 300ms};

TEST(SerialDriveSettings, NamesEveryBadField) {
  const std::string complaint = testing_support::error_of<std::invalid_argument>([] {
    check(SerialDriveSettings{.port = "", .protocol = "telepathy", .baud = 0, .counts_per_turn = -1, .address = 3});
  });
  for (const char* part : {"port", "telepathy", "create2", "baud is 0", "counts_per_turn is -1", "address is 3"}) {
    EXPECT_THAT(complaint, HasSubstr(part));
  }
  SerialDriveSettings without = Plug("roboclaw").settings(kOpeningCountsPerTurn);
  without.protocol = "create2";
  without.watchdog = false;
  EXPECT_THROW(check(without), std::invalid_argument) << "nothing would stop its wheels";
  without.protocol = "ros_arduino_bridge";
  EXPECT_THROW(check(without), std::invalid_argument) << "its own time-out is 2 s";
  without.protocol = "roboclaw";
  check(without);
}

TEST(SerialDriveSettings, RefusesADriveWithoutAWatchdogIfTheControllersTimeoutIsLonger) {
  Plug plug("roboclaw");
  SerialDriveSettings without = plug.settings(kOpeningCountsPerTurn);
  without.watchdog = false;
  EXPECT_THROW((void)open_drive(without, {12, 99ms}, plug.machine()), std::invalid_argument);
  const auto drive = value(open_drive(without, {12, 100ms}, plug.machine()));
  EXPECT_FALSE(drive->facts().has_watchdog);
  EXPECT_EQ(drive->facts().own_timeout, 100ms);
}

// Catches commands that move no wheel and report no error: the controller takes whole counts per 33 ms, and its control
// loop does nothing for an error below 2.5 of them.
TEST(SerialDriveSpeeds, TooSlowForTheControllerAreRefusedWithTheLeastPossibleOne) {
  Plug plug("ros_arduino_bridge");
  SerialDriveSettings settings = plug.settings(1440);
  const auto drive = value(open_drive(settings, kOpeningLimits, plug.machine()));
  const double least = least_speed_radps(settings);
  EXPECT_NEAR(least, 2.5 / 0.033 * 2 * std::numbers::pi / 1440, 1e-9);
  ASSERT_TRUE(drive->set_speeds({least, 0}));
  EXPECT_THAT(drive->set_speeds({0.2, -0.1}),
              FailsWith(ErrorCode::kRefused, AllOf(HasSubstr("0.2 rad/s"), HasSubstr("slower than 0.331 rad/s"))));
  plug.server().catch_up();
  EXPECT_FALSE(plug.server().turns());
  EXPECT_TRUE(drive->set_speeds({0.2, -0.4})) << "a slow wheel is allowed if the other one turns";
  settings.least_speed_radps = 0.5;
  EXPECT_EQ(least_speed_radps(settings), 0.5) << "the measured speed";
  settings.least_speed_radps = 0;
  EXPECT_NEAR(least_speed_radps(settings), 1 / 0.033 * 2 * std::numbers::pi / 1440, 1e-9)
      << "below one count per interval, zeros are sent in between";
}

/// A device that is not a motor controller: it sends its line each second. Its time advances only while the reader
/// waits.
class TalkingTransport final : public Transport {
 public:
  TalkingTransport(std::shared_ptr<Deadline> now, std::string line) : now_(std::move(now)), line_(std::move(line)) {}
  [[nodiscard]] Deadline now() const override { return *now_; }
  Status write(std::span<const std::uint8_t> /*bytes*/, Deadline /*deadline*/) override { return {}; }
  Result<std::size_t> read(std::span<std::uint8_t> room, Deadline deadline) override {
    if (come_.empty() && deadline >= next_) {
      *now_ = std::max(*now_, next_);
      next_ += 1s;
      come_ = line_;
    }
    if (come_.empty()) {
      *now_ = std::max(*now_, deadline);
      return Error{ErrorCode::kTimeout, "no answer"};
    }
    const std::size_t count = std::min(room.size(), come_.size());
    std::copy_n(come_.begin(), count, room.begin());
    come_.erase(0, count);
    return count;
  }
  Status discard_input() override {
    come_.clear();
    return {};
  }
  void pause(std::chrono::milliseconds time) override { *now_ += time; }

 private:
  std::shared_ptr<Deadline> now_;
  const std::string line_;
  Deadline next_ = *now_ + 10ms;
  std::string come_;
};

Error error_at(const std::string& protocol, const std::string& line) {
  const auto now = std::make_shared<Deadline>(1h);
  SerialDriveSettings settings = Plug(protocol).settings(kOpeningCountsPerTurn);
  Machine machine;
  machine.connect = [&]() -> Result<Connection> {
    return Connection{std::make_unique<TalkingTransport>(now, line), 0};
  };
  machine.now = [now] { return *now; };
  const auto drive = open_drive(settings, kOpeningLimits, machine);
  return drive ? Error(ErrorCode::kInvalidState, "it opens") : drive.error();
}

// Catches the message "no answer" although bytes arrived: from a GPS receiver, at a wrong rate, or in another protocol.
TEST(SerialDriveOpening, TheBytesOfAnotherDeviceAreQuoted) {
  for (const char* protocol : {"ros_arduino_bridge", "roboclaw", "create2"}) {
    const Error gps = error_at(protocol, "$GPGGA,123519,4807.038,N,01131.000,E\x1b[2J\r\n");
    EXPECT_EQ(gps.code, ErrorCode::kBadData) << protocol;
    EXPECT_THAT(gps.message, HasSubstr("the emulator: no controller of protocol " + std::string(protocol)));
    EXPECT_THAT(gps.message, HasSubstr("'$GPGGA,123519,4807.038,N,01131.000,E?[2J")) << protocol;
    const Error noise = error_at(protocol, "\xf8\x80\x1b\xe6\x98");
    EXPECT_THAT(noise.message, HasSubstr("no text, the first F8 80 1B E6 98")) << protocol;
    EXPECT_THAT(noise.message, HasSubstr("another baud")) << protocol;
    EXPECT_EQ(noise.message.find('\x1b'), std::string::npos);
  }
  EXPECT_EQ(error_at("ros_arduino_bridge", "").code, ErrorCode::kTimeout) << "no bytes arrived";
}

TEST(SerialDriveOpening, ATransportThatNoWatchdogCanHoldIsRefused) {
  Plug plug("create2");
  const auto connect = [inner = plug.machine().connect]() -> Result<Connection> {
    auto connection = inner();
    if (connection) connection->descriptor = -1;
    return connection;
  };
  EXPECT_THAT(open_drive(plug.settings(kOpeningCountsPerTurn), kOpeningLimits, {.connect = connect}),
              FailsWith(ErrorCode::kUnavailable));
}

}  // namespace
}  // namespace twocone::serial

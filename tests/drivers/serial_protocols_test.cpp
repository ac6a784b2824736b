// SPDX-License-Identifier: Apache-2.0
// Tests of the protocols: the example exchanges of the data sheets, byte for byte, and exchanges on a disturbed line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/serial_diffdrive/message_formats.h"
#include "drivers/serial_diffdrive/protocol.h"
#include "tests/emulator/memory_transport.h"
#include "tests/support/fails_with.h"

namespace twocone::serial {
namespace {

using emulator::Bench;
using emulator::MemoryTransport;
using testing::ElementsAreArray;
using testing::HasSubstr;
using testing_support::FailsWith;
using Bytes = std::vector<std::uint8_t>;

Deadline soon() { return std::chrono::steady_clock::now() + std::chrono::seconds(3); }

Bytes text(std::string_view characters) { return {characters.begin(), characters.end()}; }

/// A protocol connected to an emulated controller, after the handshake.
struct Talk {
  explicit Talk(const std::string& name, std::chrono::milliseconds command_timeout = std::chrono::milliseconds(500))
      : bench(std::make_shared<Bench>(name)),
        transport(bench),
        protocol(make_protocol({.name = name, .command_timeout = command_timeout})) {
    const auto greeted = protocol->greet(transport, soon());
    EXPECT_TRUE(greeted) << greeted.error().message;
    if (greeted) version = *greeted;
    greeting = sent();
  }
  Bytes sent() { return std::exchange(bench->received, {}); }

  std::shared_ptr<Bench> bench;
  MemoryTransport transport;
  std::unique_ptr<Protocol> protocol;
  std::string version;
  Bytes greeting;  ///< what was sent for the handshake
};

TEST(RosArduinoBridge, SendsTheBytesOfTheDataSheet) {
  Talk talk("ros_arduino_bridge");
  EXPECT_EQ(talk.version, "ros_arduino_bridge at 57600 baud");
  ASSERT_TRUE(talk.protocol->drive(talk.transport, {10 / 0.033, -10 / 0.033}));
  EXPECT_EQ(talk.sent(), text("m 10 -10\r"));
  ASSERT_TRUE(talk.protocol->drive(talk.transport, {}));
  EXPECT_EQ(talk.sent(), text("m 0 0\r"));
  talk.bench->firmware->wheels.set_counts(855, -820);
  const auto counts = talk.protocol->read_counts(talk.transport);
  ASSERT_TRUE(counts);
  EXPECT_EQ(talk.sent(), text("e\r"));
  EXPECT_EQ(std::int32_t(counts->left), 855);
  EXPECT_EQ(std::int32_t(counts->right), -820);
}

/// The emulator answers as in the example exchanges of the data sheet.
TEST(Emulated, AnswersAsInTheDataSheet) {
  Bench bench("ros_arduino_bridge");
  Bytes out;
  for (const std::string_view line : {"b\r", "r\r", "m 10 10\r", "z\r"}) {
    bench.firmware->receive({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()}, 1, out);
  }
  EXPECT_EQ(out, text("57600\r\nOK\r\nOK\r\nInvalid Command\r\n"));
  EXPECT_NEAR(bench.firmware->wheels.left_rate(), 303, 1);
}

TEST(RosArduinoBridge, WholeCountsPerIntervalHaveTheRightMean) {
  Talk talk("ros_arduino_bridge");
  double left = 0;
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(talk.protocol->drive(talk.transport, {10.37 / 0.033, 0}));
    left += talk.bench->firmware->wheels.left_rate() * 0.033 / 100;
  }
  EXPECT_NEAR(left, 10.37, 0.01);
}

TEST(RosArduinoBridge, ReadsCountsAndNothingElse) {
  EXPECT_TRUE(parse_counts("0 0"));
  EXPECT_TRUE(parse_counts("-2147483648 2147483647"));
  for (const char* bad : {"", " ", "1", "1 ", " 1", "1  2", "1 2 ", "1 2 3", "1,2", "OK", "2147483648 0", "1 2\r",
                          "+1 2", "0x1 2", "1.5 2"}) {
    EXPECT_FALSE(parse_counts(bad)) << "'" << bad << "'";
  }
}

TEST(Roboclaw, ChecksumsAndPacketsAreThoseOfTheDataSheet) {
  EXPECT_EQ(crc16(text("123456789")), 0x31C3);
  EXPECT_EQ(write_packet(0x80, 37, Bytes{0, 0, 3, 0xE8, 0xFF, 0xFF, 0xFC, 0x18}),
            (Bytes{0x80, 0x25, 0, 0, 3, 0xE8, 0xFF, 0xFF, 0xFC, 0x18, 0x82, 0x90}));
  EXPECT_EQ(write_packet(0x80, 20, {}), (Bytes{0x80, 0x14, 0x49, 0x2D}));
  EXPECT_EQ(write_packet(0x80, 14, Bytes{5}), (Bytes{0x80, 0x0E, 0x05, 0x48, 0xF0}));
  const Bytes counts{0x00, 0x01, 0xE2, 0x40, 0xFF, 0xFF, 0xFF, 0xF9, 0x98, 0xE2};
  const auto data = reply_data(0x80, 78, counts);
  ASSERT_TRUE(data);
  EXPECT_THAT(*data, ElementsAreArray(Bytes(counts.begin(), counts.end() - 2)));
  for (std::size_t i = 0; i < counts.size(); ++i) {
    Bytes turned = counts;
    turned[i] ^= 1;
    EXPECT_FALSE(reply_data(0x80, 78, turned)) << i;
  }
  EXPECT_FALSE(reply_data(0x80, 79, counts)) << "the answer to another question";
  EXPECT_FALSE(reply_data(0x80, 78, Bytes{1}));
}

TEST(Roboclaw, SendsTheBytesOfTheDataSheet) {
  Talk talk("roboclaw");
  EXPECT_EQ(talk.version, "USB Roboclaw 2x7a v4.1.34");
  EXPECT_EQ(talk.protocol->own_timeout(), std::chrono::milliseconds(500));
  ASSERT_TRUE(talk.protocol->drive(talk.transport, {1000, -1000}));
  EXPECT_EQ(talk.sent(), (Bytes{0x80, 0x25, 0, 0, 3, 0xE8, 0xFF, 0xFF, 0xFC, 0x18, 0x82, 0x90}));
  ASSERT_TRUE(talk.protocol->drive(talk.transport, {}));
  EXPECT_EQ(talk.sent(), (Bytes{0x80, 0x25, 0, 0, 0, 0, 0, 0, 0, 0, 0x34, 0x04}));
  talk.bench->firmware->wheels.set_counts(123456, -7);
  const auto counts = talk.protocol->read_counts(talk.transport);
  ASSERT_TRUE(counts);
  EXPECT_EQ(talk.sent(), (Bytes{0x80, 0x4E}));
  EXPECT_EQ(counts->left, 123456u);
  EXPECT_EQ(std::int32_t(counts->right), -7);
}

TEST(Roboclaw, SetsItsTimeoutAndChecksIt) {
  const Talk talk("roboclaw", std::chrono::milliseconds(770));
  EXPECT_EQ(talk.protocol->own_timeout(), std::chrono::milliseconds(700))
      << "rounded down: never longer than requested";
  // The version is read, the time-out is set, and then read again.
  EXPECT_EQ(talk.greeting, (Bytes{0x80, 0x15, 0x80, 0x0E, 0x07, 0x68, 0xB2, 0x80, 0x0F}));
}

TEST(Roboclaw, AnUnnoticedResetIsDetectedByItsTimeout) {
  Talk talk("roboclaw", std::chrono::milliseconds(770));
  talk.bench->firmware->reset();
  Result<RawCounts> counts = talk.protocol->read_counts(talk.transport);
  for (int i = 0; i < 20 && counts; ++i) counts = talk.protocol->read_counts(talk.transport);
  EXPECT_THAT(counts, FailsWith(ErrorCode::kDisconnected, HasSubstr("700 ms, and it reports 0 ms")))
      << "a unit without a time-out after a reset was not noticed";
}

TEST(Roboclaw, EveryExchangeOfTheDataSheetHasItsChecksum) {
  const Bytes packets[]{
      {0x80, 0x28, 0, 0, 0x13, 0x88, 0, 0, 3, 0xE8, 0xFF, 0xFF, 0xFC, 0x18, 0x74, 0xCC},
      {0x80, 0x22, 0x20, 0, 0xE0, 0, 0xBF, 0xEB},
      {0x80, 0x22, 0, 0, 0, 0, 0x98, 0x17},
      {0x80, 0x16, 0, 0, 0, 0, 0x1D, 0xFF},
      {0x80, 0x1C, 0, 0, 0x40, 0, 0, 1, 0, 0, 0, 0, 0x80, 0, 0, 0, 0xAB, 0xE0, 0x26, 0xFA},
  };
  for (const Bytes& packet : packets) {
    EXPECT_EQ(write_packet(packet[0], packet[1], std::span(packet).subspan(2, packet.size() - 4)), packet);
  }
  const std::pair<std::uint8_t, Bytes> replies[]{
      {0x0F, {0x05, 0x7B, 0xC1}},
      {0x4F, {0, 0, 3, 0xE8, 0xFF, 0xFF, 0xFC, 0x18, 0x95, 0x2D}},
      {0x10, {0, 1, 0xE2, 0x40, 0, 4, 0x54}},
      {0x12, {0, 0, 3, 0xE8, 1, 0xEA, 0x57}},
      {0x18, {0, 0x7B, 0xF8, 6}},
      {0x31, {0, 0x96, 0, 0x19, 0x3B, 0x1E}},
      {0x52, {1, 0x3B, 0x59, 0x9F}},
      {0x5A, {0, 0, 0x44, 0x37}},
      {0x5A, {0, 0, 0, 0, 0x87, 0xBC}},
      {0x15, {0x55, 0x53, 0x42, 0x20, 0x52, 0x6F, 0x62, 0x6F, 0x63, 0x6C, 0x61, 0x77, 0x20, 0x32, 0x78,
              0x37, 0x61, 0x20, 0x76, 0x34, 0x2E, 0x31, 0x2E, 0x33, 0x34, 0x0A, 0x00, 0x0B, 0xF6}},
  };
  for (const auto& [command, reply] : replies) EXPECT_TRUE(reply_data(0x80, command, reply)) << int(command);
}

/// A transport that answers each write with the next of its answers, without delay.
class AnsweringTransport final : public Transport {
 public:
  explicit AnsweringTransport(std::vector<Bytes> answers) : answers_(std::move(answers)) {}
  Status write(std::span<const std::uint8_t> /*bytes*/, Deadline /*deadline*/) override {
    if (next_ < answers_.size()) come_.insert(come_.end(), answers_[next_].begin(), answers_[next_].end());
    ++next_;
    return {};
  }
  Result<std::size_t> read(std::span<std::uint8_t> room, Deadline /*deadline*/) override {
    const std::size_t count = std::min(room.size(), come_.size());
    if (count == 0) return Error{ErrorCode::kTimeout, "no answer"};
    std::copy_n(come_.begin(), count, room.begin());
    come_.erase(come_.begin(), come_.begin() + std::ptrdiff_t(count));
    return count;
  }
  Status discard_input() override {
    come_.clear();
    return {};
  }
  void pause(std::chrono::milliseconds /*time*/) override {}

 private:
  std::vector<Bytes> answers_;
  std::size_t next_ = 0;
  Bytes come_;
};

Bytes with_checksum(std::uint8_t command, Bytes data) {
  const std::uint16_t sum = crc16(data, crc16(Bytes{0x80, command}));
  data.push_back(std::uint8_t(sum >> 8));
  data.push_back(std::uint8_t(sum));
  return data;
}

// Catches a device whose version controls the terminal in which it is shown.
TEST(Roboclaw, AVersionWithEscapeSequencesIsCleaned) {
  AnsweringTransport transport({with_checksum(21, text(std::string_view("Claw \x1b[2J\x1b]0;x\x07 v4\n\0", 20))),
                                {0xFF},
                                with_checksum(15, {5})});
  const auto version = make_protocol({.name = "roboclaw"})->greet(transport, soon());
  ASSERT_TRUE(version) << version.error().message;
  EXPECT_EQ(*version, "Claw ?[2J?]0;x? v4");
}

// The stops of another process are answered by the same byte as a command: only a checksum shows where they end.
TEST(Roboclaw, StopsOfOthersAreNotTakenForACommandsAnswer) {
  Talk talk("roboclaw");
  talk.bench->faults.delay_answers = 1;
  ASSERT_TRUE(talk.transport.write(talk.protocol->stop_bytes(), soon()));
  talk.protocol->note_stops(1);
  talk.sent();
  ASSERT_TRUE(talk.protocol->drive(talk.transport, {1000, 1000}));
  Bytes wanted{0x80, 24};
  const Bytes command = write_packet(0x80, 37, Bytes{0, 0, 3, 0xE8, 0, 0, 3, 0xE8});
  wanted.insert(wanted.end(), command.begin(), command.end());
  EXPECT_EQ(talk.sent(), wanted) << "a question, then the command, once";
}

// Catches a driver that is one line behind, and takes each answer as that of the next command.
TEST(RosArduinoBridge, StopsOfOthersAreNotTakenForACommandsAnswer) {
  for (const bool is_noted : {true, false}) {
    Talk talk("ros_arduino_bridge");
    talk.bench->firmware->wheels.set_counts(855, -820);
    talk.bench->faults.delay_answers = 1;  // the answers arrive when the next exchange has begun
    ASSERT_TRUE(talk.transport.write(talk.protocol->stop_bytes(), soon()));
    if (is_noted) talk.protocol->note_stops(1);
    for (int i = 0; i < 3; ++i) {
      const auto counts = talk.protocol->read_counts(talk.transport);
      ASSERT_TRUE(counts) << counts.error().message;
      EXPECT_EQ(std::int32_t(counts->left), 855);
      EXPECT_TRUE(talk.protocol->drive(talk.transport, {}));
    }
  }
}

TEST(Roboclaw, RefusesInvalidAddresses) {
  EXPECT_THROW(make_protocol({.name = "roboclaw", .address = 0x7F}), std::invalid_argument);
  EXPECT_THROW(make_protocol({.name = "roboclaw", .address = 0x88}), std::invalid_argument);
}

const Bytes kFrame{0x13, 0x0A, 0x07, 0x00, 0x2B, 0x03, 0xE8, 0x2C, 0xFF, 0xFA, 0x23, 0x03, 0x7B};

TEST(Create2, FindsTheFrameOfTheDataSheet) {
  Create2Stream stream;
  std::optional<Create2Sensors> sensors;
  for (const auto byte : kFrame) sensors = stream.push(byte);
  ASSERT_TRUE(sensors);
  EXPECT_EQ(sensors->counts.left, 1000u);
  EXPECT_EQ(sensors->counts.right, 65530u);
  EXPECT_EQ(sensors->mode, OiMode::kFull);
  EXPECT_EQ(sensors->bumps_and_drops, 0);
  EXPECT_EQ(stream.rubbish(), 0u);
}

TEST(Create2, NoFrameIsLostBehindRubbish) {
  // A header in the rubbish looks like the start of a frame, but must not hide the real frames after it.
  for (const Bytes& rubbish : {Bytes{0}, Bytes{19}, Bytes{19, 10}, Bytes{19, 10, 7}, Bytes{19, 200, 19, 10, 7, 0},
                               Bytes(kFrame.begin(), kFrame.end() - 1), Bytes(40, 19)}) {
    Create2Stream stream;
    int found = 0;
    for (const auto byte : rubbish) found += stream.push(byte).has_value();
    // The last candidate is rejected when the next frame arrives.
    for (int i = 0; i < 3; ++i) {
      for (const auto byte : kFrame) found += stream.push(byte).has_value();
    }
    EXPECT_GE(found, 2) << rubbish.size();
    EXPECT_GT(stream.rubbish(), 0u);
  }
}

TEST(Create2, SendsTheBytesOfTheDataSheet) {
  Talk talk("create2");
  EXPECT_EQ(talk.greeting, (Bytes{0, 0, 0, 0, 0, 0x80, 0x83, 0x94, 0x04, 0x07, 0x2B, 0x2C, 0x23}));
  const double per_mm = *talk.protocol->fixed_counts_per_turn() / (72 * 3.14159265358979);
  ASSERT_TRUE(talk.protocol->drive(talk.transport, {200 * per_mm, 200 * per_mm}));
  ASSERT_TRUE(talk.protocol->drive(talk.transport, {-200 * per_mm, 200 * per_mm}));
  ASSERT_TRUE(talk.protocol->drive(talk.transport, {}));
  EXPECT_EQ(talk.sent(), (Bytes{0x91, 0x00, 0xC8, 0x00, 0xC8, 0x91, 0x00, 0xC8, 0xFF, 0x38, 0x91, 0, 0, 0, 0}));
}

TEST(Create2, ComesBackWhenItsWheelsAreOnTheFloorAgain) {
  Talk talk("create2");
  auto& firmware = dynamic_cast<emulator::LiftableFirmware&>(*talk.bench->firmware);
  ASSERT_TRUE(talk.protocol->drive(talk.transport, {100, 100}));
  firmware.wheel_hangs = true;
  ASSERT_TRUE(talk.protocol->read_counts(talk.transport));
  std::this_thread::sleep_for(std::chrono::milliseconds(40));
  ASSERT_TRUE(talk.protocol->read_counts(talk.transport));
  EXPECT_THAT(talk.protocol->drive(talk.transport, {100, 100}),
              FailsWith(ErrorCode::kRefused, HasSubstr("a wheel hangs free")));
  EXPECT_FALSE(firmware.wheels.turn());
  firmware.wheel_hangs = false;
  EXPECT_TRUE(talk.protocol->drive(talk.transport, {100, 100}));
  EXPECT_TRUE(firmware.wheels.turn());
}

class Protocols : public testing::TestWithParam<const char*> {};

TEST_P(Protocols, StopBytesStopAfterAnyPartOfACommand) {
  const auto protocol = make_protocol({.name = GetParam()});
  Talk reference(GetParam());
  ASSERT_TRUE(reference.protocol->drive(reference.transport, {400, -300}));
  const Bytes command = reference.sent();
  for (std::size_t part = 0; part <= command.size(); ++part) {
    Talk talk(GetParam());
    ASSERT_TRUE(talk.protocol->drive(talk.transport, {400, 300}));
    ASSERT_TRUE(talk.bench->firmware->wheels.turn());
    ASSERT_TRUE(talk.transport.write(std::span(command).first(part), soon()));
    for (int i = 0; i < 2; ++i) {  // as the watchdog sends it, with a pause
      ASSERT_TRUE(talk.transport.write(protocol->stop_bytes(), soon()));
      std::this_thread::sleep_for(std::chrono::milliseconds(15));
    }
    EXPECT_FALSE(talk.bench->firmware->wheels.turn()) << part << " bytes of a command left";
  }
}

/// After a disturbed answer the next answers are right: no old bytes are taken for them.
TEST_P(Protocols, ADisturbedAnswerDisturbsNoOther) {
  using emulator::TransportFaults;
  const std::pair<const char*, int TransportFaults::*> faults[]{{"lost", &TransportFaults::lose_answers},
                                                                {"late", &TransportFaults::delay_answers},
                                                                {"double", &TransportFaults::double_answers},
                                                                {"truncated", &TransportFaults::truncate_answers},
                                                                {"garbled", &TransportFaults::garble_answers}};
  for (const auto& [what, fault] : faults) {
    for (const bool on_reading : {true, false}) {
      Talk talk(GetParam());
      auto& wheels = talk.bench->firmware->wheels;
      wheels.set_counts(1000, 2000);
      talk.bench->faults.*fault = 1;
      if (on_reading) {
        const auto counts = talk.protocol->read_counts(talk.transport);
        EXPECT_TRUE(!counts || (counts->left & 0xFFFF) == 1000u) << what;
      } else {
        static_cast<void>(talk.protocol->drive(talk.transport, {}));
      }
      for (int i = 1; i <= 3; ++i) {
        wheels.set_counts(1000 + i, 2000 - i);
        std::this_thread::sleep_for(std::chrono::milliseconds(20));  // create2 reports it with its next frame
        const auto counts = talk.protocol->read_counts(talk.transport);
        ASSERT_TRUE(counts) << what << ": " << counts.error().message;
        EXPECT_EQ(counts->left & 0xFFFF, 1000u + unsigned(i)) << what;
        EXPECT_EQ(counts->right & 0xFFFF, 2000u - unsigned(i)) << what;
        EXPECT_TRUE(talk.protocol->drive(talk.transport, {})) << what;
      }
    }
  }
}

/// Bytes that belong to no request are not an answer, whether they are complete or truncated.
TEST_P(Protocols, GarbageBetweenTheAnswersIsIgnored) {
  Talk talk(GetParam());
  for (const Bytes& garbage : {Bytes(60, 0), Bytes(60, 0xFF), Bytes(60, 19), text("\r\n\r\n"), text("12 12\r\n"),
                               text("OK\r\n7 7"), Bytes{0x13, 0x0A, 0x07}, Bytes{0, 0, 0, 1, 0, 0, 0, 1, 0, 0}}) {
    talk.bench->firmware->wheels.set_counts(1234, 4321);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    talk.bench->to_host.insert(talk.bench->to_host.end(), garbage.begin(), garbage.end());
    const auto first = talk.protocol->read_counts(talk.transport);
    const auto counts = first ? first : talk.protocol->read_counts(talk.transport);
    ASSERT_TRUE(counts) << counts.error().message;
    EXPECT_EQ(counts->left & 0xFFFF, 1234u);
    EXPECT_EQ(counts->right & 0xFFFF, 4321u);
    talk.bench->to_host.insert(talk.bench->to_host.end(), garbage.begin(), garbage.end());
    const auto driven = talk.protocol->drive(talk.transport, {300, 300});
    EXPECT_TRUE(driven || talk.protocol->drive(talk.transport, {300, 300}));
    EXPECT_TRUE(talk.bench->firmware->wheels.turn());
    EXPECT_TRUE(talk.protocol->drive(talk.transport, {}));
  }
}

TEST_P(Protocols, SilenceAndNonsenseAreDistinguished) {
  Talk talk(GetParam());
  talk.bench->faults.lose_answers = 1'000'000;
  EXPECT_THAT(talk.protocol->read_counts(talk.transport), FailsWith(ErrorCode::kTimeout));
  talk.bench->faults = {};
  talk.bench->faults.garble_answers = 1'000'000;
  EXPECT_THAT(talk.protocol->read_counts(talk.transport), FailsWith(ErrorCode::kBadData));
  talk.bench->faults = {};
  talk.bench->faults.unplugged = true;
  EXPECT_THAT(talk.protocol->read_counts(talk.transport), FailsWith(ErrorCode::kDisconnected));
}

INSTANTIATE_TEST_SUITE_P(All, Protocols, testing::Values("ros_arduino_bridge", "roboclaw", "create2"),
                         [](const auto& tested) { return std::string(tested.param); });

}  // namespace
}  // namespace twocone::serial

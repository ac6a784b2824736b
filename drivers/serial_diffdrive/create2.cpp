// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/message_formats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

#include <boost/endian/conversion.hpp>

#include "base/log.h"

namespace twocone::serial {
namespace {

using std::chrono::milliseconds;

constexpr std::uint8_t kStart = 128;
constexpr std::uint8_t kSafe = 131;
constexpr std::uint8_t kDriveDirect = 145;
constexpr std::uint8_t kStream = 148;
constexpr std::uint8_t kHeader = 19;
constexpr std::uint8_t kBumpsAndDrops = 7;
constexpr std::uint8_t kLeftCounts = 43;
constexpr std::uint8_t kRightCounts = 44;
constexpr std::uint8_t kMode = 35;
constexpr std::uint8_t kDrops = 0x0C;
constexpr std::uint8_t kBodyBytes = 10;  // the four packets with their ids
constexpr std::size_t kFrameBytes = kBodyBytes + 3;

constexpr double kCountsPerTurn = 508.8;
constexpr double kWheelDiameter_mm = 72;
constexpr double kFastest_mmps = 500;

// Pause after each mode command.
constexpr milliseconds kModePause{25};
// A frame comes every 15 ms.
constexpr milliseconds kFrameTime{100};
constexpr milliseconds kSendTime{50};
// A port buffers at least 4096 bytes; the stream fills a quarter of that in this time.
constexpr milliseconds kOld{1'000};

/// Parses a body that holds the four packets in any order, and nothing else.
std::optional<Create2Sensors> parse_body(std::span<const std::uint8_t> body) {
  std::map<std::uint8_t, std::uint16_t> packets;  // by id
  while (!body.empty()) {
    const std::uint8_t id = body.front();
    const std::size_t size = id == kLeftCounts || id == kRightCounts ? 2 : 1;
    if (body.size() < 1 + size) return std::nullopt;
    packets[id] = size == 2 ? boost::endian::load_big_u16(&body[1]) : body[1];
    body = body.subspan(1 + size);
  }
  const std::array wanted{kBumpsAndDrops, kLeftCounts, kRightCounts, kMode};
  const auto has_come = [&](std::uint8_t id) { return packets.contains(id); };
  if (packets.size() != wanted.size() || !std::ranges::all_of(wanted, has_come)) return std::nullopt;
  if (packets[kMode] > std::uint8_t(OiMode::kFull)) return std::nullopt;
  return Create2Sensors{.bumps_and_drops = std::uint8_t(packets[kBumpsAndDrops]),
                        .counts = {packets[kLeftCounts], packets[kRightCounts]},
                        .mode = OiMode(packets[kMode])};
}

class Create2 final : public Protocol {
 public:
  [[nodiscard]] int usual_baud() const override { return 115200; }
  [[nodiscard]] int counter_bits() const override { return 16; }
  [[nodiscard]] std::optional<double> fixed_counts_per_turn() const override { return kCountsPerTurn; }

  Result<std::string> greet(Transport& transport, Deadline deadline) override {
    Status awake = wake(transport);
    while (!awake && awake.error().code != ErrorCode::kDisconnected && transport.now() < deadline) {
      awake = wake(transport);
    }
    if (!awake) return awake.error();
    return std::string("Create 2 or Roomba 600, Open Interface");
  }

  [[nodiscard]] bool answers_commands() const override { return false; }
  Status drive(Transport& transport, const CountRates& rates) override {
    const bool moves = rates.left != 0 || rates.right != 0;
    if (moves) {
      if (auto there = listen(transport); !there) return there;
    }
    if (!is_awake()) {
      base::Logger("serial").warning("the robot left mode Safe; it is requested again");
      // The robot left mode Safe by itself (a wheel drop, a cliff, the charger). It accepts Safe again after that.
      if (auto sent = send(transport, std::array{kSafe}); !sent) return sent;
      transport.pause(kModePause);
      if (auto seen = next_sensors(transport); !seen) return seen.error();
      if (!is_awake()) {
        return Error(ErrorCode::kRefused, "the robot does not leave mode {}: {}",
                     sensors_.mode == OiMode::kOff ? "Off" : "Passive", reason());
      }
    }
    std::array<std::uint8_t, 5> bytes{kDriveDirect};
    boost::endian::store_big_s16(bytes.data() + 1, millimetres(rates.right));
    boost::endian::store_big_s16(bytes.data() + 3, millimetres(rates.left));
    return send(transport, bytes);
  }

  Result<RawCounts> read_counts(Transport& transport) override {
    if (auto seen = next_sensors(transport); !seen) return seen.error();
    return sensors_.counts;
  }

  // A command that was left half sent needs at most four more bytes. The first stop may serve as those; the second stop
  // is then complete.
  [[nodiscard]] std::vector<std::uint8_t> stop_bytes() const override {
    return {kDriveDirect, 0, 0, 0, 0, kDriveDirect, 0, 0, 0, 0};
  }
  // The robot answers no command.
  void note_stops(std::uint32_t /*times*/) override {}
  // The robot's unit is a whole millimetre per second.
  [[nodiscard]] double least_command() const override {
    return kCountsPerTurn / (kWheelDiameter_mm * std::numbers::pi);
  }
  [[nodiscard]] std::optional<milliseconds> own_timeout() const override { return std::nullopt; }

 private:
  static std::int16_t millimetres(double rate) {
    const double mmps = rate * kWheelDiameter_mm * std::numbers::pi / kCountsPerTurn;
    return static_cast<std::int16_t>(std::lround(std::clamp(mmps, -kFastest_mmps, kFastest_mmps)));
  }

  [[nodiscard]] bool is_awake() const { return sensors_.mode == OiMode::kSafe || sensors_.mode == OiMode::kFull; }

  Status wake(Transport& transport) {
    // Five zeros complete a command that was left half sent; zero itself is not a command.
    if (auto sent = send(transport, std::array<std::uint8_t, 5>{}); !sent) return sent;
    for (const std::uint8_t opcode : {kStart, kSafe}) {
      if (auto sent = send(transport, std::array{opcode}); !sent) return sent;
      transport.pause(kModePause);
    }
    if (auto clean = transport.discard_input(); !clean) return clean;
    stream_ = {};
    looked_ = transport.now();
    const std::array<std::uint8_t, 6> packets{kStream, 4, kBumpsAndDrops, kLeftCounts, kRightCounts, kMode};
    if (auto sent = send(transport, packets); !sent) return sent;
    if (auto seen = next_sensors(transport); !seen) return seen;
    if (!is_awake()) return Error(ErrorCode::kRefused, "it does not go to mode Safe: {}", reason());
    return {};
  }

  [[nodiscard]] std::string reason() const {
    if ((sensors_.bumps_and_drops & kDrops) != 0) return "a wheel hangs free; put it on the floor";
    return "it does not report why; take it off its charger and away from a cliff, and charge its battery";
  }

  static Status send(Transport& transport, std::span<const std::uint8_t> bytes) {
    return transport.write(bytes, transport.in(kSendTime));
  }

  /// Gets the newest frame: reads all bytes that have arrived and, if they hold no frame, waits for the next one.
  Status next_sensors(Transport& transport) {
    if (auto fresh = forget_old(transport); !fresh) return fresh;
    const Deadline deadline = transport.in(kFrameTime);
    const std::uint64_t before = stream_.rubbish();
    bool found = false;
    std::array<std::uint8_t, 4096> room;
    do {
      const auto got = transport.read(room, found ? transport.now() : deadline);
      if (!got && got.error().code != ErrorCode::kTimeout) return got.error();
      if (!got) break;
      found = take(std::span(room).first(*got), transport.now()) || found;
    } while (transport.now() < deadline);
    if (stream_.rubbish() > before) base::Logger("serial").info("bytes that belong to no packet are skipped");
    if (found) return {};
    if (stream_.rubbish() > before) {
      return Error{ErrorCode::kBadData, "the bytes received are not a stream of sensor packets"};
    }
    return Error{ErrorCode::kTimeout, "no sensor packets arrive"};
  }

  bool take(std::span<const std::uint8_t> bytes, Deadline now) {
    bool found = false;
    for (const std::uint8_t byte : bytes) {
      const auto sensors = stream_.push(byte);
      if (!sensors) continue;
      sensors_ = *sensors;
      found = true;
    }
    if (found) seen_ = now;
    return found;
  }

  /// Reads the stream, which shows that the robot is present and awake. The robot answers no command.
  Status listen(Transport& transport) {
    std::array<std::uint8_t, 4096> room;
    const auto got = transport.read(room, transport.now());
    if (!got && got.error().code != ErrorCode::kTimeout) return got.error();
    if (got) take(std::span(room).first(*got), transport.now());
    if (transport.now() - seen_ <= kFrameTime) return {};
    return next_sensors(transport);
  }

  /// Discards old input: a port that was not read for long is full of old frames, and has no space for the newest.
  Status forget_old(Transport& transport) {
    const Deadline before = std::exchange(looked_, transport.now());
    if (looked_ - before < kOld) return {};
    stream_ = {};
    return transport.discard_input();
  }

  Create2Stream stream_;
  Create2Sensors sensors_;
  Deadline looked_{};  // time of the last reading of the stream
  Deadline seen_{};    // time of the last frame
};

}  // namespace

std::optional<Create2Sensors> Create2Stream::push(std::uint8_t byte) {
  if (waiting_.empty() && byte != kHeader) {
    ++rubbish_;
    return std::nullopt;
  }
  waiting_.push_back(byte);
  while (waiting_.size() >= 2) {
    if (waiting_[1] == kBodyBytes) {
      if (waiting_.size() < kFrameBytes) return std::nullopt;
      const auto sum = std::accumulate(waiting_.begin(), waiting_.begin() + kFrameBytes, 0u);
      const auto sensors = (sum & 0xFF) == 0 ? parse_body(std::span(waiting_).subspan(2, kBodyBytes)) : std::nullopt;
      if (sensors) {
        waiting_.erase(waiting_.begin(), waiting_.begin() + kFrameBytes);
        return sensors;
      }
    }
    const auto next = std::find(waiting_.begin() + 1, waiting_.end(), kHeader);
    rubbish_ += std::uint64_t(next - waiting_.begin());
    waiting_.erase(waiting_.begin(), next);
  }
  return std::nullopt;
}

std::unique_ptr<Protocol> make_create2() { return std::make_unique<Create2>(); }

}  // namespace twocone::serial

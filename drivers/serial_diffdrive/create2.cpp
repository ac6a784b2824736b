// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/create2.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

#include <fmt/format.h>

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
constexpr std::uint8_t kBodyBytes = 10;  // the four packets with their numbers
constexpr std::size_t kFrameBytes = kBodyBytes + 3;

constexpr double kCountsPerTurn = 508.8;
constexpr double kWheelDiameter_mm = 72;
constexpr double kFastest_mmps = 500;

// Between mode commands.
constexpr milliseconds kModePause{25};
// A frame comes every 15 ms.
constexpr milliseconds kFrameTime{100};
constexpr milliseconds kSendTime{50};
// Of 4096 bytes, which ports keep at least, the stream fills a quarter in this time.
constexpr milliseconds kOld{1'000};

std::uint32_t word(std::span<const std::uint8_t> bytes) { return std::uint32_t(bytes[0]) << 8 | bytes[1]; }

/// The four packets in any order, and nothing else.
std::optional<Create2Sensors> parse_body(std::span<const std::uint8_t> body) {
  Create2Sensors sensors;
  unsigned seen = 0;
  while (!body.empty()) {
    const std::uint8_t id = body.front();
    const std::size_t size = id == kLeftCounts || id == kRightCounts ? 2 : 1;
    if (body.size() < 1 + size) return std::nullopt;
    const auto data = body.subspan(1, size);
    body = body.subspan(1 + size);
    switch (id) {
      case kBumpsAndDrops:
        sensors.bumps_and_drops = data.front();
        seen |= 1;
        break;
      case kLeftCounts:
        sensors.counts.left = word(data);
        seen |= 2;
        break;
      case kRightCounts:
        sensors.counts.right = word(data);
        seen |= 4;
        break;
      case kMode:
        if (data.front() > std::uint8_t(OiMode::kFull)) return std::nullopt;
        sensors.mode = OiMode(data.front());
        seen |= 8;
        break;
      default:
        return std::nullopt;
    }
  }
  if (seen != 15) return std::nullopt;
  return sensors;
}

class Create2 final : public Protocol {
 public:
  [[nodiscard]] int usual_baud() const override { return 115200; }
  [[nodiscard]] int counter_bits() const override { return 16; }
  [[nodiscard]] std::optional<double> fixed_counts_per_turn() const override { return kCountsPerTurn; }

  Result<std::string> greet(Wire& wire, Deadline deadline) override {
    Status awake = wake(wire);
    while (!awake && awake.error().code != ErrorCode::kDisconnected && wire.now() < deadline) {
      awake = wake(wire);
    }
    if (!awake) return awake.error();
    return std::string("Create 2 or Roomba 600, Open Interface");
  }

  [[nodiscard]] bool answers_commands() const override { return false; }
  Status drive(Wire& wire, const CountRates& rates) override {
    const bool moves = rates.left != 0 || rates.right != 0;
    if (moves) {
      if (auto there = listen(wire); !there) return there;
    }
    if (!is_awake()) {
      // It left Safe by itself: a wheel drop, a cliff, the charger. It comes back when that is over.
      if (auto told = say(wire, std::array{kSafe}); !told) return told;
      wire.pause(kModePause);
      if (auto seen = next_sensors(wire); !seen) return seen.error();
      if (!is_awake()) {
        return Error{ErrorCode::kRefused, fmt::format("the robot does not leave mode {}: {}",
                                                      sensors_.mode == OiMode::kOff ? "Off" : "Passive", reason())};
      }
    }
    const auto right = millimetres(rates.right);
    const auto left = millimetres(rates.left);
    return say(wire, std::array{kDriveDirect, high(right), low(right), high(left), low(left)});
  }

  Result<RawCounts> read_counts(Wire& wire) override {
    if (auto seen = next_sensors(wire); !seen) return seen.error();
    return sensors_.counts;
  }

  // What was left half sent takes at most four bytes more. The first command may be those; the second is whole.
  [[nodiscard]] std::vector<std::uint8_t> stop_bytes() const override {
    return {kDriveDirect, 0, 0, 0, 0, kDriveDirect, 0, 0, 0, 0};
  }
  // No command is answered.
  void note_stops(std::uint32_t /*times*/) override {}
  // It takes whole millimetres a second.
  [[nodiscard]] double least_command() const override {
    return kCountsPerTurn / (kWheelDiameter_mm * std::numbers::pi);
  }
  [[nodiscard]] std::optional<milliseconds> own_timeout() const override { return std::nullopt; }

 private:
  static std::int16_t millimetres(double rate) {
    const double mmps = rate * kWheelDiameter_mm * std::numbers::pi / kCountsPerTurn;
    return static_cast<std::int16_t>(std::lround(std::clamp(mmps, -kFastest_mmps, kFastest_mmps)));
  }
  static std::uint8_t high(std::int16_t value) { return static_cast<std::uint8_t>(std::uint16_t(value) >> 8); }
  static std::uint8_t low(std::int16_t value) { return static_cast<std::uint8_t>(value); }

  [[nodiscard]] bool is_awake() const { return sensors_.mode == OiMode::kSafe || sensors_.mode == OiMode::kFull; }

  Status wake(Wire& wire) {
    // Five zeros end whatever was left half sent; zero is no command.
    if (auto said = say(wire, std::array<std::uint8_t, 5>{}); !said) return said;
    for (const std::uint8_t opcode : {kStart, kSafe}) {
      if (auto said = say(wire, std::array{opcode}); !said) return said;
      wire.pause(kModePause);
    }
    if (auto clean = wire.discard_input(); !clean) return clean;
    stream_ = {};
    looked_ = wire.now();
    const std::array<std::uint8_t, 6> packets{kStream, 4, kBumpsAndDrops, kLeftCounts, kRightCounts, kMode};
    if (auto said = say(wire, packets); !said) return said;
    if (auto seen = next_sensors(wire); !seen) return seen;
    if (!is_awake()) return Error{ErrorCode::kRefused, fmt::format("it does not go to mode Safe: {}", reason())};
    return {};
  }

  [[nodiscard]] std::string reason() const {
    if ((sensors_.bumps_and_drops & kDrops) != 0) return "a wheel hangs free; put it on the floor";
    return "it does not say why; take it off its charger and away from a cliff, and charge its battery";
  }

  static Status say(Wire& wire, std::span<const std::uint8_t> bytes) { return wire.write(bytes, wire.in(kSendTime)); }

  /// The newest frame: all that came is read, and if that is none, the next is waited for.
  Status next_sensors(Wire& wire) {
    if (auto fresh = forget_old(wire); !fresh) return fresh;
    const Deadline deadline = wire.in(kFrameTime);
    const std::uint64_t before = stream_.rubbish();
    bool found = false;
    std::array<std::uint8_t, 4096> room;
    do {
      const auto got = wire.read(room, found ? wire.now() : deadline);
      if (!got && got.error().code != ErrorCode::kTimeout) return got.error();
      if (!got) break;
      found = take(std::span(room).first(*got), wire.now()) || found;
    } while (wire.now() < deadline);
    if (found) return {};
    if (stream_.rubbish() > before) return Error{ErrorCode::kBadData, "what comes is no stream of sensor packets"};
    return Error{ErrorCode::kTimeout, "no sensor packets come"};
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

  /// Nothing answers a command: that the robot is there, and awake, its stream tells.
  Status listen(Wire& wire) {
    std::array<std::uint8_t, 4096> room;
    const auto got = wire.read(room, wire.now());
    if (!got && got.error().code != ErrorCode::kTimeout) return got.error();
    if (got) take(std::span(room).first(*got), wire.now());
    if (wire.now() - seen_ <= kFrameTime) return {};
    return next_sensors(wire);
  }

  /// A port that nobody read for long is full of old frames, and has no room for the newest.
  Status forget_old(Wire& wire) {
    const Deadline before = std::exchange(looked_, wire.now());
    if (looked_ - before < kOld) return {};
    stream_ = {};
    return wire.discard_input();
  }

  Create2Stream stream_;
  Create2Sensors sensors_;
  Deadline looked_{};  // when the stream was read last
  Deadline seen_{};    // when a frame was found last
};

}  // namespace

std::optional<Create2Sensors> Create2Stream::push(std::uint8_t byte) {
  if (waiting_.empty() && byte != kHeader) {
    ++rubbish_;
    return std::nullopt;
  }
  waiting_.push_back(byte);
  return take_front();
}

std::optional<Create2Sensors> Create2Stream::take_front() {
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

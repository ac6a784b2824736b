// SPDX-License-Identifier: Apache-2.0
#include "tests/emulator/firmware.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

#include "tests/emulator/arduino_emulator.h"

namespace twocone::emulator {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append(Bytes& out, std::string_view text) { out.insert(out.end(), text.begin(), text.end()); }

std::int64_t whole(double counts) { return static_cast<std::int64_t>(std::floor(counts)); }

class RosArduinoBridge final : public Firmware {
 private:
  static constexpr double kFrame_s = 0.033;
  static constexpr double kAutoStop_s = 2.0;

  void begin() override {
    line_.clear();
    moved_s_ = -kAutoStop_s;
  }

  void run_until(double now_s, Bytes& /*out*/) override {
    if (now_s - moved_s_ > kAutoStop_s) wheels.set(0, 0);
  }

  void take(std::uint8_t byte, double now_s, Bytes& out) override {
    if (byte == '\r') {
      append(out, answer(now_s) + "\r\n");
      line_.clear();
    } else {
      line_.push_back(char(byte));
    }
  }

  std::string answer(double now_s) {
    const ArduinoRequest request = parse_arduino_request(line_);
    switch (request.command) {
      case 'b':
        return "57600";
      case 'e':
        return std::to_string(std::int32_t(whole(wheels.left()))) + " " +
               std::to_string(std::int32_t(whole(wheels.right())));
      case 'r':
        wheels.set_counts(0, 0);
        return "OK";
      case 'm':
        moved_s_ = now_s;
        wheels.set(request.first / kFrame_s, request.second / kFrame_s);
        return "OK";
      case 'u':
        return "OK";
      default:
        return "Invalid Command";
    }
  }

  std::string line_;
  double moved_s_ = -kAutoStop_s;
};

class Roboclaw final : public Firmware {
 private:
  static constexpr std::uint8_t kAddress = 0x80;
  static constexpr double kByteGap_s = 0.010;

  void begin() override {
    packet_.clear();
    timeout_ = 0;
  }

  void run_until(double now_s, Bytes& /*out*/) override {
    if (timeout_ > 0 && now_s - received_s_ > 0.1 * timeout_) wheels.set(0, 0);
  }

  static std::uint16_t crc(std::span<const std::uint8_t> bytes, std::uint16_t crc = 0) {
    for (const std::uint8_t byte : bytes) {
      for (int bit = 7; bit >= 0; --bit) {
        const bool high = ((crc >> 15) ^ (byte >> bit)) & 1;
        crc = std::uint16_t(crc << 1);
        if (high) crc = std::uint16_t(crc ^ 0x1021);
      }
    }
    return crc;
  }

  /// The number of data bytes of a write command.
  static std::optional<std::size_t> data_of(std::uint8_t command) {
    switch (command) {
      case 14:
        return 1;
      case 20:
        return 0;
      case 22:
      case 23:
      case 34:
      case 35:
      case 36:
        return 4;
      case 37:
        return 8;
      case 40:
        return 12;
      case 28:
      case 29:
        return 16;
      default:
        return std::nullopt;
    }
  }

  void take(std::uint8_t byte, double now_s, Bytes& out) override {
    if (now_s - byte_s_ > kByteGap_s) packet_.clear();
    byte_s_ = now_s;
    packet_.push_back(byte);
    if (packet_[0] != kAddress) {
      packet_.clear();
      return;
    }
    if (packet_.size() < 2) return;
    if (const auto data = data_of(packet_[1])) {
      if (packet_.size() < *data + 4) return;
      const std::span<const std::uint8_t> all(packet_);
      const auto sum = crc(all.first(all.size() - 2));
      if (sum == (packet_[packet_.size() - 2] << 8 | packet_.back())) {
        received_s_ = now_s;
        obey(packet_[1], all.subspan(2, *data));
        out.push_back(0xFF);
      }
    } else if (const auto reply = reply_to(packet_[1])) {
      received_s_ = now_s;
      out.insert(out.end(), reply->begin(), reply->end());
      const auto sum = crc(*reply, crc(std::span(packet_).first(2)));
      out.push_back(std::uint8_t(sum >> 8));
      out.push_back(std::uint8_t(sum));
    }
    packet_.clear();
  }

  static std::int32_t number(std::span<const std::uint8_t> data, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | data[at + i];
    return std::int32_t(value);
  }

  void obey(std::uint8_t command, std::span<const std::uint8_t> data) {
    switch (command) {
      case 14:
        timeout_ = data[0];
        break;
      case 20:
        wheels.set_counts(0, 0);
        break;
      case 22:
        wheels.set_counts(number(data, 0), wheels.right());
        break;
      case 23:
        wheels.set_counts(wheels.left(), number(data, 0));
        break;
      case 35:
        wheels.set(number(data, 0), wheels.right_rate());
        break;
      case 36:
        wheels.set(wheels.left_rate(), number(data, 0));
        break;
      case 37:
        wheels.set(number(data, 0), number(data, 4));
        break;
      case 40:
        wheels.set(number(data, 4), number(data, 8));
        break;
      default:
        break;
    }
  }

  static void put(Bytes& reply, std::int64_t value, int bytes) {
    for (int i = bytes - 1; i >= 0; --i) reply.push_back(std::uint8_t(std::uint64_t(value) >> (8 * i)));
  }

  [[nodiscard]] std::optional<Bytes> reply_to(std::uint8_t command) const {
    Bytes reply;
    switch (command) {
      case 15:
        put(reply, timeout_, 1);
        return reply;
      case 16:
      case 17:
        put(reply, whole(command == 16 ? wheels.left() : wheels.right()), 4);
        put(reply, 0, 1);
        return reply;
      case 21:
        append(reply, std::string_view("USB Roboclaw 2x7a v4.1.34\n\0", 27));
        return reply;
      case 24:
        put(reply, 123, 2);
        return reply;
      case 78:
        put(reply, whole(wheels.left()), 4);
        put(reply, whole(wheels.right()), 4);
        return reply;
      case 79:
        put(reply, std::int64_t(wheels.left_rate()), 4);
        put(reply, std::int64_t(wheels.right_rate()), 4);
        return reply;
      case 90:
        put(reply, 0, 4);
        return reply;
      default:
        return std::nullopt;
    }
  }

  Bytes packet_;
  double byte_s_ = -1;
  double received_s_ = 0;
  int timeout_ = 0;
};

class Create2 final : public LiftableFirmware {
 private:
  static constexpr double kUpdate_s = 0.015;
  static constexpr double kCounts_per_mm = 508.8 / (std::numbers::pi * 72);

  void begin() override {
    command_.clear();
    streamed_.clear();
    mode_ = 0;
    drive(0, 0);
  }

  void run_until(double now_s, Bytes& out) override {
    if (wheel_hangs && mode_ == 2) {
      mode_ = 1;
      drive(0, 0);
    }
    if (streamed_.empty() || !streams_) {
      next_s_ = now_s + kUpdate_s;
      return;
    }
    // A port that was not read for long holds at most this time of the stream.
    if (now_s - next_s_ > 1) next_s_ = now_s - 1;
    for (; next_s_ <= now_s; next_s_ += kUpdate_s) {
      Bytes body;
      for (const std::uint8_t id : streamed_) {
        body.push_back(id);
        put(body, id);
      }
      Bytes frame{19, std::uint8_t(body.size())};
      frame.insert(frame.end(), body.begin(), body.end());
      std::uint8_t sum = 0;
      for (const std::uint8_t byte : frame) sum = std::uint8_t(sum + byte);
      frame.push_back(std::uint8_t(-sum));
      out.insert(out.end(), frame.begin(), frame.end());
    }
  }

  /// The length of a command with its opcode; the first byte of 148 and 149 gives theirs.
  [[nodiscard]] std::size_t length() const {
    switch (command_.front()) {
      case 145:
      case 146:
      case 137:
        return 5;
      case 142:
      case 150:
        return 2;
      case 148:
      case 149:
        return command_.size() < 2 ? 2 : 2 + std::size_t(command_[1]);
      default:
        return 1;
    }
  }

  void take(std::uint8_t byte, double /*now_s*/, Bytes& out) override {
    command_.push_back(byte);
    if (command_.size() < length()) return;
    obey(out);
    command_.clear();
  }

  [[nodiscard]] int word(std::size_t at) const {
    return std::int16_t(std::uint16_t(command_[at] << 8 | command_[at + 1]));
  }

  void drive(double left_mmps, double right_mmps) {
    wheels.set(left_mmps * kCounts_per_mm, right_mmps * kCounts_per_mm);
  }

  void obey(Bytes& out) {
    switch (command_.front()) {
      case 128:
        mode_ = 1;
        drive(0, 0);
        break;
      case 131:
        if (mode_ != 0) mode_ = wheel_hangs ? 1 : 2;
        break;
      case 132:
        if (mode_ != 0) mode_ = 3;
        break;
      case 173:
        mode_ = 0;
        streamed_.clear();
        drive(0, 0);
        break;
      case 145:
        if (mode_ >= 2 && std::abs(word(1)) <= 500 && std::abs(word(3)) <= 500) drive(word(3), word(1));
        break;
      case 142:
        put(out, command_[1]);
        break;
      case 149:
        for (std::size_t i = 2; i < command_.size(); ++i) put(out, command_[i]);
        break;
      case 148:
        streamed_.assign(command_.begin() + 2, command_.end());
        streams_ = true;
        break;
      case 150:
        streams_ = command_[1] != 0;
        break;
      default:
        break;
    }
  }

  void put(Bytes& out, std::uint8_t id) const {
    const auto counts = [&](double value) {
      const auto low = std::uint16_t(whole(value));
      out.push_back(std::uint8_t(low >> 8));
      out.push_back(std::uint8_t(low));
    };
    switch (id) {
      case 7:
        out.push_back(wheel_hangs ? 0x0C : 0);
        break;
      case 35:
        out.push_back(std::uint8_t(mode_));
        break;
      case 43:
        counts(wheels.left());
        break;
      case 44:
        counts(wheels.right());
        break;
      default:
        out.push_back(0);
        break;
    }
  }

  Bytes command_;
  Bytes streamed_;
  bool streams_ = false;
  double next_s_ = 0;
  int mode_ = 0;
};

}  // namespace

std::unique_ptr<Firmware> make_firmware(std::string_view protocol) {
  if (protocol == "ros_arduino_bridge") return std::make_unique<RosArduinoBridge>();
  if (protocol == "roboclaw") return std::make_unique<Roboclaw>();
  if (protocol == kArduinoEmulator) return std::make_unique<ArduinoEmulator>();
  if (protocol == "create2") return std::make_unique<Create2>();
  throw std::invalid_argument("no emulator for protocol '" + std::string(protocol) + "'");
}

}  // namespace twocone::emulator

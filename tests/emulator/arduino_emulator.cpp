// SPDX-License-Identifier: Apache-2.0
#include "tests/emulator/arduino_emulator.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

namespace twocone::emulator {
namespace {

// The firmware's default gains.
constexpr int kP = 20, kD = 12, kO = 50;
constexpr int kFullPower = 255;
// Up to this power, friction holds a wheel.
constexpr int kSticks = 30;
constexpr double kFullRate = 2600;  // counts per second
constexpr double kInertia_s = 0.04;
constexpr double kStandsStill = 2;  // counts per second

/// The final rate of a motor with this power.
double rate_of(int power) {
  if (std::abs(power) <= kSticks) return 0;
  return std::copysign(kFullRate * (std::abs(power) - kSticks) / (kFullPower - kSticks), power);
}

int atoi16(const std::string& text) { return static_cast<std::int16_t>(std::atol(text.c_str())); }

}  // namespace

ArduinoRequest parse_arduino_request(const std::string& line) {
  const auto space = line.find(' ');
  const std::string word = line.substr(0, space);
  if (word.empty()) return {};
  std::string first, second;
  if (space != std::string::npos) {
    const auto next = line.find(' ', space + 1);
    first = line.substr(space + 1, next == std::string::npos ? next : next - space - 1);
    if (next != std::string::npos) second = line.substr(next + 1);
  }
  return {word.back(), atoi16(first), atoi16(second)};
}

void ArduinoEmulator::Loop::step(long count) {
  const int before = speed;
  speed = int(count - counted);
  counted = count;
  // This is integer arithmetic: the remainder of the division is lost, and so is every error below kO / kP counts.
  power = std::clamp(power + (kP * (target - speed) - kD * (speed - before)) / kO, -kFullPower, kFullPower);
}

void ArduinoEmulator::begin() {
  line_.clear();
  left_ = right_ = {};
  moves_ = false;
  ++resets_;
}

void ArduinoEmulator::turn_motors(double now_s) {
  const double share = 1 - std::exp(-(now_s - motors_s_) / kInertia_s);
  motors_s_ = now_s;
  const auto towards = [share](double rate, int power) {
    const double wanted = rate_of(power);
    const double next = rate + (wanted - rate) * share;
    return wanted == 0 && std::abs(next) < kStandsStill ? 0 : next;
  };
  const int left = motors_crossed ? right_.power : left_.power;
  const int right = motors_crossed ? left_.power : right_.power;
  wheels.set(towards(wheels.left_rate(), left), towards(wheels.right_rate(), right));
}

void ArduinoEmulator::run_until(double now_s, std::vector<std::uint8_t>& /*out*/) {
  turn_motors(now_s);
  if (now_s - received_s_ > kAutoStop_s) {
    moves_ = false;
    left_.stop();
    right_.stop();
  }
  if (now_s - interval_s_ < kInterval_s) return;
  interval_s_ = now_s - std::fmod(now_s - interval_s_, kInterval_s);
  const long left = long(std::floor(wheels.left())), right = long(std::floor(wheels.right()));
  if (moves_) {
    left_.step(left);
    right_.step(right);
  } else {
    // A loop that starts again starts at the counters' present values.
    left_ = {.counted = left};
    right_ = {.counted = right};
  }
}

void ArduinoEmulator::take(std::uint8_t byte, double now_s, std::vector<std::uint8_t>& out) {
  if (byte == '\r') {
    const std::string text = answer(now_s) + "\r\n";
    out.insert(out.end(), text.begin(), text.end());
    line_.clear();
  } else if (line_.size() < 40) {
    line_.push_back(char(byte));
  }
}

std::string ArduinoEmulator::answer(double now_s) {
  const ArduinoRequest request = parse_arduino_request(line_);
  switch (request.command) {
    case 'b':
      return "57600";
    case 'e':
      return std::to_string(std::int32_t(std::floor(wheels.left()))) + " " +
             std::to_string(std::int32_t(std::floor(wheels.right())));
    case 'r':
      wheels.set_counts(0, 0);
      left_ = right_ = {};
      return "OK";
    case 'm': {
      received_s_ = now_s;
      if (request.first == 0 && request.second == 0) {
        moves_ = false;
        left_.stop();
        right_.stop();
      } else {
        moves_ = true;
        moved_s_ = now_s;
        left_.target = request.first;
        right_.target = request.second;
      }
      return "OK";
    }
    case 'u':
      return "OK";
    default:
      return "Invalid Command";
  }
}

}  // namespace twocone::emulator

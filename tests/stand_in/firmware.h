// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Stand-ins for motor controllers: what their firmware answers, written from the protocols' sheets and from nothing
/// that the drivers use, in a time that the caller tells.
namespace twocone::stand_in {

/// Two wheels that turn at once as they are told to.
class Wheels {
 public:
  void set(double left_rate, double right_rate) {
    left_rate_ = left_rate;
    right_rate_ = right_rate;
  }
  void advance_to(double now_s) {
    left_ += left_rate_ * (now_s - now_s_);
    right_ += right_rate_ * (now_s - now_s_);
    now_s_ = now_s;
  }
  /// Counts since the last reset; they may be set, to be near a wrap.
  void set_counts(double left, double right) {
    left_ = left;
    right_ = right;
  }
  [[nodiscard]] double left() const { return left_; }
  [[nodiscard]] double right() const { return right_; }
  [[nodiscard]] double left_rate() const { return left_rate_; }
  [[nodiscard]] double right_rate() const { return right_rate_; }
  [[nodiscard]] bool turn() const { return left_rate_ != 0 || right_rate_ != 0; }

 private:
  double now_s_ = 0;
  double left_rate_ = 0, right_rate_ = 0;  // counts a second
  double left_ = 0, right_ = 0;
};

class Firmware {
 public:
  virtual ~Firmware() = default;

  /// Takes bytes that arrive now; what is answered is added to `out`.
  void receive(std::span<const std::uint8_t> bytes, double now_s, std::vector<std::uint8_t>& out) {
    pass_time(now_s, out);
    for (const std::uint8_t byte : bytes) take(byte, now_s, out);
  }
  /// Lets time pass: wheels turn, time-outs run out, streams stream.
  void pass_time(double now_s, std::vector<std::uint8_t>& out) {
    wheels.advance_to(now_s);
    tick(now_s, out);
  }
  /// As after power-on.
  void reset() {
    wheels.set(0, 0);
    wheels.set_counts(0, 0);
    begin();
  }

  Wheels wheels;

 private:
  virtual void take(std::uint8_t byte, double now_s, std::vector<std::uint8_t>& out) = 0;
  virtual void tick(double now_s, std::vector<std::uint8_t>& out) = 0;
  virtual void begin() = 0;
};

/// Create 2's firmware can be lifted off the floor.
class LiftableFirmware : public Firmware {
 public:
  bool wheel_hangs = false;
};

/// The name of ros_arduino_bridge with the real firmware's control loop and motors (arduino_emulator.h).
inline constexpr std::string_view kArduinoEmulator = "arduino_emulator";

/// @throws std::invalid_argument for a name that is none of ros_arduino_bridge, roboclaw, create2, kArduinoEmulator
std::unique_ptr<Firmware> make_firmware(std::string_view protocol);

}  // namespace twocone::stand_in

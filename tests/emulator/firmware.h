// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Emulated motor controllers: the answers of their firmware. They are written from the protocols' data sheets, without
/// any code of the drivers, and run in a time that the caller gives.
namespace twocone::emulator {

/// Two wheels that reach a commanded rate at once.
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
  /// Sets the counts since the last reset, for example to values near a wrap.
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
  double left_rate_ = 0, right_rate_ = 0;  // counts per second
  double left_ = 0, right_ = 0;
};

class Firmware {
 public:
  virtual ~Firmware() = default;

  /// Processes bytes that arrive now; appends the answers to `out`.
  void receive(std::span<const std::uint8_t> bytes, double now_s, std::vector<std::uint8_t>& out) {
    pass_time(now_s, out);
    for (const std::uint8_t byte : bytes) take(byte, now_s, out);
  }
  /// Lets time pass: wheels turn, time-outs expire, streams send.
  void pass_time(double now_s, std::vector<std::uint8_t>& out) {
    wheels.advance_to(now_s);
    run_until(now_s, out);
  }
  /// Sets the state after power-on.
  void reset() {
    wheels.set(0, 0);
    wheels.set_counts(0, 0);
    begin();
  }

  Wheels wheels;

 private:
  virtual void take(std::uint8_t byte, double now_s, std::vector<std::uint8_t>& out) = 0;
  virtual void run_until(double now_s, std::vector<std::uint8_t>& out) = 0;
  virtual void begin() = 0;
};

/// The firmware of a robot that can be lifted off the floor (Create 2).
class LiftableFirmware : public Firmware {
 public:
  bool wheel_hangs = false;
};

/// The name of ros_arduino_bridge with the real firmware's control loop and motors (arduino_emulator.h).
inline constexpr std::string_view kArduinoEmulator = "arduino_emulator";

/// @throws std::invalid_argument for a name other than ros_arduino_bridge, roboclaw, create2, kArduinoEmulator
std::unique_ptr<Firmware> make_firmware(std::string_view protocol);

}  // namespace twocone::emulator

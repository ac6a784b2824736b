// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tests/emulator/firmware.h"

/// An emulator of a board with ros_arduino_bridge that behaves as the real firmware was observed to behave: a control
/// loop in integers, motors with inertia that small powers do not move, an answer to every line, and a reset without a
/// boot loader's pause. It is written from the protocol's description and from observations of the board.
namespace twocone::emulator {

/// A line of the protocol without its CR.
struct ArduinoRequest {
  char command = 0;           ///< the last character in the position of the command; 0: none
  int first = 0, second = 0;  ///< read as 16 bits; a missing argument is 0
};
ArduinoRequest parse_arduino_request(const std::string& line);

class ArduinoEmulator final : public Firmware {
 public:
  static constexpr double kInterval_s = 0.033;
  static constexpr double kAutoStop_s = 2.0;

  bool motors_crossed = false;  ///< each control loop drives the other loop's wheel

  /// Returns whether a motor has power; the wheels may coast without it.
  [[nodiscard]] bool has_power() const { return left_.power != 0 || right_.power != 0; }
  /// Time at which the last command that moves was processed; < 0: none was.
  [[nodiscard]] double moved_s() const { return moved_s_; }
  [[nodiscard]] int resets() const { return resets_; }

 private:
  /// The control loop of a wheel, in counts per interval.
  struct Loop {
    int target = 0;
    int power = 0;  // -255 to 255
    int speed = 0;  // in the last interval
    long counted = 0;

    void stop() { target = power = 0; }
    void step(long count);
  };

  void begin() override;
  void run_until(double now_s, std::vector<std::uint8_t>& out) override;
  void take(std::uint8_t byte, double now_s, std::vector<std::uint8_t>& out) override;
  std::string answer(double now_s);
  void turn_motors(double now_s);

  std::string line_;
  Loop left_, right_;
  bool moves_ = false;
  double received_s_ = -kAutoStop_s;  // time of the last `m`
  double moved_s_ = -1;
  double interval_s_ = 0;  // end of the last control interval
  double motors_s_ = 0;
  int resets_ = -1;
};

}  // namespace twocone::emulator

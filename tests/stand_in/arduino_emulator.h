// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tests/stand_in/firmware.h"

/// An emulator of a board with ros_arduino_bridge that behaves as the real firmware was seen to: a control loop in
/// whole numbers, motors with inertia that small powers do not move, answers to every line, and a reset without a boot
/// loader's pause. Written from the protocol's description and from what the board was observed to do.
namespace twocone::stand_in {

/// A line of the protocol without its CR.
struct ArduinoRequest {
  char command = 0;           ///< in the command position the last character wins; 0: none
  int first = 0, second = 0;  ///< read as 16 bits; what is absent is 0
};
ArduinoRequest parse_arduino_request(const std::string& line);

class ArduinoEmulator final : public Firmware {
 public:
  static constexpr double kInterval_s = 0.033;
  static constexpr double kAutoStop_s = 2.0;

  bool motors_crossed = false;  ///< each control loop drives the other one's wheel

  /// Whether a bridge has power; the wheels may coast without.
  [[nodiscard]] bool has_power() const { return left_.power != 0 || right_.power != 0; }
  /// When the last command that moves was taken; < 0: none was.
  [[nodiscard]] double moved_s() const { return moved_s_; }
  [[nodiscard]] int resets() const { return resets_; }

 private:
  /// The control loop of a wheel, in counts per interval.
  struct Loop {
    int target = 0;
    int power = 0;  // -255 to 255
    int speed = 0;  // in the last interval
    long counted = 0;

    void rest() { target = power = 0; }
    void step(long count);
  };

  void begin() override;
  void tick(double now_s, std::vector<std::uint8_t>& out) override;
  void take(std::uint8_t byte, double now_s, std::vector<std::uint8_t>& out) override;
  std::string answer(double now_s);
  void turn_motors(double now_s);

  std::string line_;
  Loop left_, right_;
  bool moves_ = false;
  double heard_s_ = -kAutoStop_s;  // the last `m`
  double moved_s_ = -1;
  double interval_s_ = 0;  // when the last one ended
  double motors_s_ = 0;
  int resets_ = -1;
};

}  // namespace twocone::stand_in

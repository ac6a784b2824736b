// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "drivers/serial_diffdrive/serial_diffdrive.h"
#include "tests/emulator/arduino_emulator.h"

/// A program, its watchdog and a controller in one simulated time, so that each may be suspended at any moment, and a
/// schedule is repeatable by its seed.
namespace twocone::emulator {

class SimulatedWatchdog;

/// Faults that occur until `end`.
struct Troubles {
  std::chrono::nanoseconds end{0};  ///< in simulated time
  double lose = 0;                  ///< probability that a byte is lost, in both directions
  double garble = 0;                ///< probability that one bit of a byte is inverted, in both directions
  double hold_up = 0;               ///< probability that the program is suspended, at each write, read and wake()
  std::chrono::nanoseconds shortest_hold_up{0}, longest_hold_up{0};
};

class SimulatedLine {
 public:
  using Nanoseconds = std::chrono::nanoseconds;
  static constexpr Nanoseconds kNever = Nanoseconds::max();

  /// @param latency the longest time for which the adapter holds bytes from the controller
  SimulatedLine(std::uint64_t seed, Nanoseconds latency);

  [[nodiscard]] Nanoseconds now() const { return now_; }
  [[nodiscard]] serial::Deadline steady_now() const { return serial::Deadline(now_); }
  /// Processes all events until that time.
  void advance_to(Nanoseconds time);
  void advance(Nanoseconds time) { advance_to(now_ + time); }
  /// Called after each step of at most a millisecond.
  std::function<void()> watch = [] {};
  /// Called with the bytes on the line, for a person.
  std::function<void(const char* who, std::span<const std::uint8_t> bytes)> trace = [](auto, auto) {};

  ArduinoEmulator& board() { return board_; }
  Troubles troubles;
  /// Restarts the board's processor. Bytes in transit to it are lost. @param silence time of a boot loader
  void reset_board(Nanoseconds silence);

  /// The services for a drive over this line.
  serial::Machine machine();
  /// The present watchdog; nullptr: none.
  SimulatedWatchdog* watchdog = nullptr;
  /// Total time for which the program was suspended.
  Nanoseconds held_up{0};

  // For the ends of the line.
  void send(const char* who, std::span<const std::uint8_t> bytes);
  void forget_unsent();
  /// Returns bytes that have arrived.
  std::size_t receive(std::span<std::uint8_t> room);
  void forget_received();
  [[nodiscard]] Nanoseconds next_arrival() const { return to_host_.empty() ? kNever : to_host_.front().time; }
  void maybe_hold_up();
  std::mt19937_64& random() { return random_; }
  /// Draws a uniformly distributed time.
  Nanoseconds draw(Nanoseconds from, Nanoseconds to);

 private:
  struct Byte {
    Nanoseconds time;
    std::uint8_t value;
  };
  [[nodiscard]] bool is_troubled() const { return now_ < troubles.end; }
  bool chance(double probability);
  void push(std::deque<Byte>& queue, Nanoseconds time, std::uint8_t byte);
  void answer(const std::vector<std::uint8_t>& bytes);
  void step_board();

  Nanoseconds now_{std::chrono::hours(1)};
  const Nanoseconds begin_ = now_;
  const Nanoseconds latency_;
  std::mt19937_64 random_;
  ArduinoEmulator board_;
  Nanoseconds boots_until_{0};
  std::deque<Byte> to_board_, to_host_;
  Nanoseconds board_free_{0}, host_free_{0};  // end of the last byte in each direction
};

/// WatchdogSteps run in simulated time.
class SimulatedWatchdog final : public serial::Watchdog {
 public:
  SimulatedWatchdog(SimulatedLine& line, std::vector<std::uint8_t> stop_bytes, std::chrono::nanoseconds timeout);
  ~SimulatedWatchdog() override;

  [[nodiscard]] std::chrono::nanoseconds wake_time() const { return wake_; }
  void run();
  /// Halts it, as by SIGSTOP.
  void halt_until(std::chrono::nanoseconds time) { halted_until_ = time; }
  [[nodiscard]] bool is_halted() const { return line_.now() < halted_until_; }
  /// Returns whether it will do nothing before that time.
  [[nodiscard]] bool is_out_until(std::chrono::nanoseconds time) const { return is_dead_ || time < halted_until_; }
  /// Kills it, as by SIGKILL from outside.
  void die() { is_dead_ = true; }

 private:
  struct Shared {
    serial::WatchdogState state;
  };
  SimulatedWatchdog(SimulatedLine& line, std::vector<std::uint8_t> stop_bytes, std::chrono::nanoseconds timeout,
                    std::unique_ptr<Shared> shared);
  Status wake() override;
  void do_end(std::chrono::milliseconds patience) noexcept override;
  [[nodiscard]] std::int64_t now_ns() const override { return line_.now().count(); }
  void nap() override;
  [[nodiscard]] std::string name() const override { return "simulated"; }

  SimulatedLine& line_;
  const std::vector<std::uint8_t> stop_bytes_;
  std::unique_ptr<Shared> shared_;
  serial::WatchdogSteps steps_;
  std::chrono::nanoseconds wake_ = SimulatedLine::kNever;
  std::chrono::nanoseconds halted_until_{0};
  bool writes_ = false, is_first_ = false;
  bool is_dead_ = false;
};

}  // namespace twocone::emulator

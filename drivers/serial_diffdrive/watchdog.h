// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

#include "hal/result.h"

/// The rule by which a second process, the watchdog, stops the wheels when the program cannot, and how the two know of
/// each other. Both sides are written without processes and clocks: guard.h runs them in two processes, a test in one
/// simulated time.
namespace twocone::serial {

/// A page of memory that the program and its watchdog share. Each field has one writer, but for `moves_until_ns`, which
/// the watchdog may prolong.
struct WatchdogState {
  /// Steady clock; from then on the watchdog writes the stop. 0: the wheels are at rest.
  std::atomic<std::int64_t> moves_until_ns{0};
  std::atomic<std::uint32_t> said{0};   ///< by the program: how often it has written moves_until_ns
  std::atomic<std::uint32_t> heard{0};  ///< by the watchdog: the newest `said` whose deadline it has seen
  /// By the watchdog: how often it began, and has ended, to write the stop. A stop is counted before it is written, so
  /// that no answer to it can come uncounted. One that is given up because the program spoke counts in both, too.
  std::atomic<std::uint32_t> stops_begun{0};
  std::atomic<std::uint32_t> stops_done{0};
};
static_assert(std::atomic<std::int64_t>::is_always_lock_free && std::atomic<std::uint32_t>::is_always_lock_free,
              "processes share no lock");

/// How often a stop is written in a row: the first may be lost in what the program left half sent, or on the line.
constexpr int kStopsInARow = 3;
constexpr std::chrono::nanoseconds kBetweenStops{15'000'000};

/// The watchdog's side. Only what a signal handler may do: no memory, no lock, no exception.
class WatchdogSteps {
 public:
  WatchdogSteps(WatchdogState& state, std::int64_t timeout_ns) : state_(state), timeout_ns_(timeout_ns) {}

  struct Step {
    bool writes_stop = false;   ///< write the stop now, then call wrote_stop()
    bool is_first = false;      ///< of a row: what waits to be sent is to be forgotten
    std::int64_t wake_ns = -1;  ///< else: sleep until then, or until the program speaks; < 0: until it speaks
  };
  /// What to do now. To be called at each wake-up.
  Step next(std::int64_t now_ns);
  /// After a row of stops the silence may last: the next row comes after another time-out, because a program that was
  /// halted before its command says it when it goes on.
  void wrote_stop(std::int64_t now_ns);

 private:
  WatchdogState& state_;
  const std::int64_t timeout_ns_;
  std::int64_t expired_ns_ = 0;  // the deadline that the present row of stops is for
  int left_ = 0;                 // stops of that row
  std::int64_t next_ns_ = 0;     // when the next of them is due
};

/// The program's side. Once expect_motion() has returned, no stop is written before the new deadline: either the
/// watchdog saw the deadline before it wrote, or the program has waited until it had written. A stop that is written
/// after the deadline is counted.
class Watchdog {
 public:
  virtual ~Watchdog() = default;
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// Before a command that moves: the wheels may turn for another time-out. Waits while a stop is being written.
  /// Errors: kUnavailable (the watchdog is gone, or halted while it wrote: the wheels must not turn).
  Status expect_motion();
  /// After the wheels were stopped. Waits and errors as expect_motion().
  Status expect_rest();
  /// Waits while a stop is being written. Errors: kUnavailable (it was halted while it wrote).
  Status settle();
  /// Waits until the watchdog has seen the last deadline. Errors: kUnavailable (it is gone, or was not awake for half
  /// the time-out: a watchdog that is so late cannot keep the rule).
  Status is_heard();
  /// Stops that it has written so far, and those that it has begun to write. An exchange with the controller met none
  /// if the second, after it, is the first, before it.
  [[nodiscard]] std::uint32_t stops_done() const { return state_->stops_done; }
  [[nodiscard]] std::uint32_t stops_begun() const { return state_->stops_begun; }
  /// Ends it at once, whatever it does. Its stops stay readable.
  void kill() noexcept { do_end(std::chrono::milliseconds(0)); }

 protected:
  Watchdog(WatchdogState& state, std::chrono::nanoseconds timeout) : state_(&state), timeout_(timeout) {}
  /// Errors: kUnavailable.
  virtual Status wake() = 0;
  /// Sends it away, and ends it by force after so long.
  virtual void do_end(std::chrono::milliseconds patience) noexcept = 0;
  [[nodiscard]] virtual std::int64_t now_ns() const = 0;
  /// For a small part of a millisecond.
  virtual void nap() = 0;
  /// For messages: "process 4711".
  [[nodiscard]] virtual std::string name() const = 0;

 private:
  void say(std::int64_t moves_until_ns);
  [[nodiscard]] Status wait_until(bool (*is_true)(const WatchdogState&), std::int64_t limit_ns);

  WatchdogState* const state_;
  const std::chrono::nanoseconds timeout_;
  std::int64_t said_at_ns_ = 0;
};

}  // namespace twocone::serial

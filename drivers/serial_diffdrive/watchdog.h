// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hal/result.h"

/// The rule by which a second process, the watchdog, stops the wheels if the program cannot, and the communication of
/// the two. Both sides are independent of processes and clocks: start_watchdog_process() runs them in two processes,
/// and a test runs them in one simulated time.
namespace twocone::serial {

/// A page of memory that the program and its watchdog share. Each field has one writer, except `moves_until_ns`, which
/// the watchdog may extend.
struct WatchdogState {
  /// Deadline on the steady clock, from which on the watchdog writes the stop. 0: the wheels are stopped.
  std::atomic<std::int64_t> moves_until_ns{0};
  std::atomic<std::uint32_t> deadlines_set{0};   ///< by the program: how often it has written moves_until_ns
  std::atomic<std::uint32_t> deadlines_seen{0};  ///< by the watchdog: the `deadlines_set` of the last deadline it saw
  /// By the watchdog: how many stops it has begun and finished to write. A stop is counted before it is written, so
  /// that no answer to it can come uncounted. A stop that is dropped because the program set a new deadline counts in
  /// both.
  std::atomic<std::uint32_t> stops_begun{0};
  std::atomic<std::uint32_t> stops_done{0};
};
static_assert(std::atomic<std::int64_t>::is_always_lock_free && std::atomic<std::uint32_t>::is_always_lock_free,
              "processes share no lock");

/// The number of stops written in a row. The first may be lost in a command that the program left half sent, or on the
/// line.
constexpr int kStopsInARow = 3;
constexpr std::chrono::nanoseconds kBetweenStops{15'000'000};

/// The watchdog's side. It does only what a signal handler may do: no allocation, no lock, no exception.
class WatchdogSteps {
 public:
  WatchdogSteps(WatchdogState& state, std::int64_t timeout_ns) : state_(state), timeout_ns_(timeout_ns) {}

  struct Step {
    bool writes_stop = false;   ///< write the stop now, then call wrote_stop()
    bool is_first = false;      ///< the first stop of a row: discard the bytes that wait to be sent
    std::int64_t wake_ns = -1;  ///< if no stop: sleep until this time or a message of the program; < 0: until a message
  };
  /// Returns the next action. Call it at each wake-up.
  Step next(std::int64_t now_ns);
  /// Call it after a stop was written. After a row of stops, the next row is due after another time-out: a program that
  /// was halted before its command sends it when it continues.
  void wrote_stop(std::int64_t now_ns);

 private:
  WatchdogState& state_;
  const std::int64_t timeout_ns_;
  std::int64_t expired_ns_ = 0;  // the deadline for which the present row of stops is written
  int left_ = 0;                 // remaining stops of that row
  std::int64_t next_ns_ = 0;     // time at which the next of them is due
};

/// The program's side. After expect_motion() has returned, no stop is written before the new deadline: either the
/// watchdog saw the deadline before it wrote, or the program waited until the stop was written. A stop that is written
/// after the deadline is counted.
class Watchdog {
 public:
  virtual ~Watchdog() = default;
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// Allows the wheels to turn for another time-out. Call it before a command that moves. Waits while a stop is being
  /// written. Errors: kUnavailable (the watchdog is gone, or was halted while it wrote: the wheels must not turn).
  Status expect_motion();
  /// Removes the deadline. Call it after the wheels were stopped. Waits and errors as expect_motion().
  Status expect_stop();
  /// Waits while a stop is being written. Errors: kUnavailable (the watchdog was halted while it wrote).
  Status settle();
  /// Waits until the watchdog has seen the last deadline. Errors: kUnavailable (it is gone, or did not run for half the
  /// time-out: a watchdog that is so late cannot keep the rule).
  Status wait_until_seen();
  /// Return the numbers of stops that the watchdog has finished and has begun to write. No stop fell into an exchange
  /// with the controller if stops_begun() after it equals stops_done() before it.
  [[nodiscard]] std::uint32_t stops_done() const { return state_->stops_done; }
  [[nodiscard]] std::uint32_t stops_begun() const { return state_->stops_begun; }
  /// Ends the watchdog at once, whatever it does. The numbers of its stops remain readable.
  void kill() noexcept { do_end(std::chrono::milliseconds(0)); }

 protected:
  Watchdog(WatchdogState& state, std::chrono::nanoseconds timeout) : state_(&state), timeout_(timeout) {}
  /// Sends a message that wakes the watchdog. Errors: kUnavailable.
  virtual Status wake() = 0;
  /// Requests its end, and kills it after `patience`.
  virtual void do_end(std::chrono::milliseconds patience) noexcept = 0;
  [[nodiscard]] virtual std::int64_t now_ns() const = 0;
  /// Sleeps for a small part of a millisecond.
  virtual void nap() = 0;
  /// Returns the watchdog's name for messages: "process 4711".
  [[nodiscard]] virtual std::string name() const = 0;

 private:
  void set_deadline(std::int64_t moves_until_ns);
  [[nodiscard]] Status wait_until(bool (*is_true)(const WatchdogState&), std::int64_t limit_ns);

  WatchdogState* const state_;
  const std::chrono::nanoseconds timeout_;
  std::int64_t set_at_ns_ = 0;
};

/// Starts a watchdog as a small process that holds the open port and runs WatchdogSteps, and waits until it is ready.
/// It reads the deadline from a shared page and is woken through a pipe. The end of the pipe means the end of the
/// program.
///
/// The process is a copy of this program (fork without exec) in its own session, so that neither a terminal's Ctrl-C
/// nor a signal to this program's group reaches it. It ignores all signals that may be ignored, and ends with the pipe.
/// It runs before ordinary processes if the system allows it (root, or RLIMIT_RTPRIO). It cannot act if it is killed or
/// halted too, or if the port is gone: then only the controller's own time-out remains.
///
/// The destructor of the result ends the watchdog, which stops the wheels once more, and waits until its process is
/// gone. The process is killed if that takes longer than half a second.
///
/// Errors: kUnavailable (no process, memory or pipe is available).
/// @param port the open port, with non-blocking writes; the watchdog keeps it open as long as it runs
/// @param stop_bytes the bytes that stop the wheels after any bytes sent before
/// @param timeout time since the last expect_motion(), > 0
Result<std::unique_ptr<Watchdog>> start_watchdog_process(int port, std::vector<std::uint8_t> stop_bytes,
                                                         std::chrono::nanoseconds timeout);

}  // namespace twocone::serial

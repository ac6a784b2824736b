// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/watchdog.h"

#include <algorithm>

#include <fmt/format.h>

namespace twocone::serial {

WatchdogSteps::Step WatchdogSteps::next(std::int64_t now_ns) {
  // In this order: a program that is told it was heard knows that its deadline is seen.
  state_.heard = state_.said.load();
  while (true) {
    const std::int64_t until_ns = state_.moves_until_ns;
    if (left_ > 0 && until_ns != expired_ns_) left_ = 0;  // the program spoke
    if (left_ == 0) {
      if (until_ns == 0) return {};
      if (now_ns < until_ns) return {.wake_ns = until_ns};
      expired_ns_ = until_ns;
      left_ = kStopsInARow;
      next_ns_ = now_ns;
    }
    if (now_ns < next_ns_) return {.wake_ns = next_ns_};
    ++state_.stops_begun;
    if (state_.moves_until_ns == expired_ns_) return {.writes_stop = true, .is_first = left_ == kStopsInARow};
    ++state_.stops_done;
  }
}

void WatchdogSteps::wrote_stop(std::int64_t now_ns) {
  ++state_.stops_done;
  next_ns_ = now_ns + kBetweenStops.count();
  if (--left_ > 0) return;
  std::int64_t expired_ns = expired_ns_;
  state_.moves_until_ns.compare_exchange_strong(expired_ns, now_ns + timeout_ns_);
}

void Watchdog::say(std::int64_t moves_until_ns) {
  said_at_ns_ = now_ns();
  state_->moves_until_ns = moves_until_ns;
  ++state_->said;
}

Status Watchdog::wait_until(bool (*is_true)(const WatchdogState&), std::int64_t limit_ns) {
  while (!is_true(*state_)) {
    const std::int64_t time_ns = now_ns();
    if (time_ns >= limit_ns) {
      return Error{
          ErrorCode::kUnavailable,
          fmt::format("the watchdog, {}, did not run for {:.0f} ms: it is halted, or the machine is overloaded", name(),
                      1e-6 * double(time_ns - said_at_ns_))};
    }
    // Without a word to it a watchdog that is gone would look like a slow one.
    if (auto there = wake(); !there) return there;
    nap();
  }
  return {};
}

Status Watchdog::expect_motion() {
  say(now_ns() + timeout_.count());
  if (auto there = wake(); !there) return there;
  return settle();
}

Status Watchdog::expect_rest() {
  say(0);
  return settle();
}

Status Watchdog::settle() {
  return wait_until([](const WatchdogState& state) { return state.stops_done == state.stops_begun; },
                    now_ns() + timeout_.count() / 2);
}

Status Watchdog::is_heard() {
  // The exchange with the controller has given it time already; where that took all of it, or the whole machine stood
  // still, it has an eighth more.
  const std::int64_t limit_ns = std::max(said_at_ns_ + timeout_.count() / 2, now_ns() + timeout_.count() / 8);
  return wait_until([](const WatchdogState& state) { return state.heard == state.said; }, limit_ns);
}

}  // namespace twocone::serial

// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/watchdog.h"

#include <algorithm>

#include <fmt/format.h>

namespace twocone::serial {

WatchdogSteps::Step WatchdogSteps::next(std::int64_t now_ns) {
  // The order matters: the deadline that is read below is at least as new as the one that is confirmed here.
  state_.deadlines_seen = state_.deadlines_set.load();
  while (true) {
    const std::int64_t until_ns = state_.moves_until_ns;
    if (left_ > 0 && until_ns != expired_ns_) left_ = 0;  // the program set a new deadline
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

void Watchdog::set_deadline(std::int64_t moves_until_ns) {
  set_at_ns_ = now_ns();
  state_->moves_until_ns = moves_until_ns;
  ++state_->deadlines_set;
}

Status Watchdog::wait_until(bool (*is_true)(const WatchdogState&), std::int64_t limit_ns) {
  while (!is_true(*state_)) {
    const std::int64_t time_ns = now_ns();
    if (time_ns >= limit_ns) {
      return Error{
          ErrorCode::kUnavailable,
          fmt::format("the watchdog, {}, did not run for {:.0f} ms: it is halted, or the machine is overloaded", name(),
                      1e-6 * double(time_ns - set_at_ns_))};
    }
    // A message shows that the watchdog is gone; otherwise it would look like a slow one.
    if (auto there = wake(); !there) return there;
    nap();
  }
  return {};
}

Status Watchdog::expect_motion() {
  set_deadline(now_ns() + timeout_.count());
  if (auto there = wake(); !there) return there;
  return settle();
}

Status Watchdog::expect_stop() {
  set_deadline(0);
  return settle();
}

Status Watchdog::settle() {
  return wait_until([](const WatchdogState& state) { return state.stops_done == state.stops_begun; },
                    now_ns() + timeout_.count() / 2);
}

Status Watchdog::wait_until_seen() {
  // The watchdog had time already during the exchange with the controller. If that took all of it, or if the whole
  // machine was suspended, the watchdog has an eighth of the time-out more.
  const std::int64_t limit_ns = std::max(set_at_ns_ + timeout_.count() / 2, now_ns() + timeout_.count() / 8);
  return wait_until([](const WatchdogState& state) { return state.deadlines_seen == state.deadlines_set; }, limit_ns);
}

}  // namespace twocone::serial

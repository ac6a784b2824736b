// SPDX-License-Identifier: Apache-2.0
#include "hal/clock.h"

#include <stdexcept>

namespace twocone {

std::chrono::nanoseconds operator-(const Timestamp& later, const Timestamp& earlier) {
  if (later.clock != earlier.clock) {
    throw std::invalid_argument("Timestamp: a simulated time and a steady-clock time cannot be compared");
  }
  return later.since_zero - earlier.since_zero;
}

Timestamp SteadyClock::now() const { return {ClockKind::kSteady, std::chrono::steady_clock::now().time_since_epoch()}; }

Timestamp ManualClock::now() const { return {kind_, std::chrono::nanoseconds(now_ns_.load())}; }

void ManualClock::advance(std::chrono::nanoseconds step) {
  if (step.count() < 0) throw std::invalid_argument("ManualClock: step is negative; time does not run backwards");
  now_ns_ += step.count();
}

}  // namespace twocone

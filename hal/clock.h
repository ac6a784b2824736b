// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <stdexcept>

namespace twocone {

enum class ClockKind {
  kSimulated,  ///< the simulated world's time; 0 when the world begins
  kSteady,     ///< std::chrono::steady_clock; its zero has no meaning
};

/// A moment and the clock that measured it. Moments of different clocks cannot be compared.
struct Timestamp {
  ClockKind clock = ClockKind::kSteady;
  std::chrono::nanoseconds since_zero{0};

  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(since_zero).count(); }
  friend bool operator==(const Timestamp&, const Timestamp&) = default;
};

/// Returns `later - earlier`. @throws std::invalid_argument if the two come from different clocks.
inline std::chrono::nanoseconds operator-(const Timestamp& later, const Timestamp& earlier) {
  if (later.clock != earlier.clock) {
    throw std::invalid_argument("Timestamp: a simulated time and a steady-clock time cannot be compared");
  }
  return later.since_zero - earlier.since_zero;
}

/// The longest time that any call waits, even if a longer one is requested. A longer one could overflow a deadline.
constexpr std::chrono::milliseconds kLongestWait = std::chrono::hours(24);

/// A source of time. It is passed in and never global, so that a test or a simulation controls its own time.
class Clock {
 public:
  virtual ~Clock() = default;
  Clock() = default;
  Clock(const Clock&) = delete;
  Clock& operator=(const Clock&) = delete;
  [[nodiscard]] virtual Timestamp now() const = 0;
};

class SteadyClock final : public Clock {
 public:
  [[nodiscard]] Timestamp now() const override {
    return {ClockKind::kSteady, std::chrono::steady_clock::now().time_since_epoch()};
  }
};

/// A clock that changes only by advance(). It may be read from any thread.
class ManualClock final : public Clock {
 public:
  explicit ManualClock(ClockKind kind = ClockKind::kSimulated) : kind_(kind) {}
  [[nodiscard]] Timestamp now() const override { return {kind_, std::chrono::nanoseconds(now_ns_.load())}; }
  /// @throws std::invalid_argument for a negative step: time does not run backwards.
  void advance(std::chrono::nanoseconds step) {
    if (step.count() < 0) throw std::invalid_argument("ManualClock: step is negative; time does not run backwards");
    now_ns_ += step.count();
  }

 private:
  const ClockKind kind_;
  std::atomic<std::chrono::nanoseconds::rep> now_ns_{0};
};

}  // namespace twocone

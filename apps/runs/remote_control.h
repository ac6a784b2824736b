// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <mutex>

#include "apps/behaviours/behaviour.h"

namespace twocone::runs {

/// What a person requests of a robot while it drives, from another thread: how to drive (behaviour manual), and a stop
/// that holds the wheels whichever behaviour drives. Any thread may call it.
class RemoteControl {
 public:
  using Clock = std::chrono::steady_clock;
  /// How long a request to drive is valid. It must be repeated more often: when nothing arrives, because a page was
  /// closed or a network is down, the wheels stop.
  static constexpr std::chrono::milliseconds kValid{300};

  /// Requests a motion until kValid has passed.
  void drive(const behaviours::Shares& shares);
  /// Requests rest.
  void release() { drive({}); }
  /// Returns the requested motion; rest, if the request is older than kValid.
  [[nodiscard]] behaviours::Shares requested() const;

  /// Holds the wheels until hold(false).
  void hold(bool held);
  [[nodiscard]] bool is_held() const;

 private:
  mutable std::mutex mutex_;  // protects all members below
  behaviours::Shares shares_;
  Clock::time_point at_{};
  bool is_held_ = false;
};

}  // namespace twocone::runs

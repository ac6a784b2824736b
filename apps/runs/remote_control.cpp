// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/remote_control.h"

namespace twocone::runs {

void RemoteControl::drive(const behaviours::Shares& shares) {
  const std::lock_guard lock(mutex_);
  shares_ = shares;
  at_ = Clock::now();
}

behaviours::Shares RemoteControl::requested() const {
  const std::lock_guard lock(mutex_);
  return Clock::now() - at_ <= kValid ? shares_ : behaviours::Shares{};
}

void RemoteControl::hold(bool held) {
  const std::lock_guard lock(mutex_);
  is_held_ = held;
}

bool RemoteControl::is_held() const {
  const std::lock_guard lock(mutex_);
  return is_held_;
}

}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace twocone::runs {

/// What the simulation tells from threads of its own.
class Notices {
 public:
  void add(const std::string& notice) {
    const std::lock_guard lock(mutex_);
    notices_.push_back(notice);
  }
  std::vector<std::string> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(notices_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> notices_;
};

}  // namespace twocone::runs

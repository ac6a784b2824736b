// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <optional>
#include <string>

#include "hal/clock.h"

namespace twocone::doctor {

/// Everything that the doctor needs besides the devices. The caller provides it, so that a test controls time and user.
struct Surroundings {
  const Clock& clock;
  std::function<void(std::chrono::nanoseconds)> sleep;
  /// Puts a question to the user, who may take minutes; no answer: nothing. Empty: there is no user.
  std::function<std::optional<std::string>(const std::string& question)> ask{};
  /// Called with the current work and its fraction done, 0 to 1.
  std::function<void(const std::string& what, double share)> progress = [](const std::string&, double) {};
  /// Set from outside: wheels and cameras are then stopped, and the report ends.
  const std::atomic<bool>& stop;

  [[nodiscard]] double now_s() const { return clock.now().seconds(); }
};

/// Thrown by a check that was stopped from outside.
class Interrupted : public std::exception {
 public:
  [[nodiscard]] const char* what() const noexcept override { return "stopped from outside"; }
};

inline double seconds_of(std::chrono::nanoseconds time) { return std::chrono::duration<double>(time).count(); }
inline std::chrono::nanoseconds nanoseconds_of(double seconds) {
  return std::chrono::nanoseconds(std::int64_t(1e9 * seconds));
}

/// Stops a device at the end of a block, however it ends.
template <typename Device>
class Stopping {
 public:
  explicit Stopping(Device& device) : device_(device) {}
  ~Stopping() { static_cast<void>(device_.stop()); }
  Stopping(const Stopping&) = delete;
  Stopping& operator=(const Stopping&) = delete;

 private:
  Device& device_;
};

inline void end_if_asked(const Surroundings& surroundings) {
  if (surroundings.stop) throw Interrupted();
}

}  // namespace twocone::doctor

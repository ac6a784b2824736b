// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace twocone::runs {

/// Paces the frames of a simulated run by the wall clock, and measures how late each begins.
///
/// All frames are due on one grid, which the first wait begins. A frame whose predecessor took too long begins at once,
/// and the frames after it stay due when they were: they follow without waiting until the run is on time again. Beside
/// the run, a thread that does nothing else sleeps to times of the same period. Its lateness is the machine's.
class RealTime {
 public:
  using Clock = std::chrono::steady_clock;
  using Milliseconds = std::chrono::duration<double, std::milli>;
  /// A frame is late if it begins later than this share of the period.
  static constexpr double kLateShare = 0.1;

  /// @param period > 0
  explicit RealTime(Milliseconds period) : period_(period) {}

  /// Waits until the next frame is due, or until `stop` is set.
  void wait(const std::atomic<bool>& stop);
  /// Returns the time until the next frame is due; before the first wait: 0.
  [[nodiscard]] Milliseconds left() const;
  /// Returns the number of frames that began late so far.
  [[nodiscard]] int late() const { return late_; }
  /// Ends the measurement. Returns a sentence about the frames and the bare sleeper; nothing was waited for: empty.
  [[nodiscard]] std::string report();

 private:
  /// Returns when the grid's line `number` is.
  [[nodiscard]] Clock::time_point due(double number) const {
    return *begin_ + std::chrono::duration_cast<Clock::duration>(period_ * number);
  }
  void sleep_bare(const std::stop_token& stop);

  Milliseconds period_;
  std::optional<Clock::time_point> begin_;
  std::vector<Milliseconds> late_by_;  ///< of the frames
  int late_ = 0;
  std::vector<Milliseconds> bare_late_by_;  ///< belongs to sleeper_ while it runs
  std::jthread sleeper_;
};

/// Returns a text such as "2 of 449 frames late, median 0.08 ms, worst 12.1 ms".
std::string describe_lateness(std::vector<RealTime::Milliseconds> late_by, RealTime::Milliseconds period);

}  // namespace twocone::runs

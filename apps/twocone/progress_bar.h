// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <mutex>
#include <string>

namespace twocone::cli {

/// Returns "render [######....]  61 % 0:12 left", shorter than `columns`. In few columns the bar is short or absent.
/// @param done share, clamped to [0, 1]
[[nodiscard]] std::string progress_line(const std::string& what, double done, double spent_s, int columns);

/// Shows one line on stderr with a bar and the remaining time, after two seconds. It is silent if stderr is no
/// terminal. Any thread may call it.
class ProgressBar {
 public:
  explicit ProgressBar(std::string what);
  /// Removes the bar.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(double done);
  /// Prints a separate line on stderr, above the bar.
  void say(const std::string& line);

 private:
  void clear();  ///< with mutex_ locked

  using Clock = std::chrono::steady_clock;
  std::mutex mutex_;
  std::string what_;
  bool terminal_;
  bool shown_ = false;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point last_ = begin_;
};

}  // namespace twocone::cli

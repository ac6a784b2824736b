// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

namespace twocone::cli {

/// "render [######....]  61 % 0:12 left": shorter than `columns`, with a shorter bar or none where that is little.
/// @param done share, clamped to [0, 1]
[[nodiscard]] std::string progress_line(const std::string& what, double done, double spent_s, int columns);

/// One line on stderr with a bar and the time left, from two seconds on. Quiet when stderr is no terminal.
class ProgressBar {
 public:
  explicit ProgressBar(std::string what);
  /// Takes the bar away.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(double done);
  /// A line of its own on stderr, above the bar.
  void say(const std::string& line);

 private:
  void clear();

  using Clock = std::chrono::steady_clock;
  std::string what_;
  bool terminal_;
  bool shown_ = false;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point last_ = begin_;
};

}  // namespace twocone::cli

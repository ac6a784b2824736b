// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

namespace twocone::cli {

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

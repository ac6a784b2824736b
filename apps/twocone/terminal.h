// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>

/// Standard output holds results, standard error all other messages and the progress bar. A signal ends the work in
/// good order.
namespace twocone::cli {

/// Opens /dev/null in place of standard input, output and error if the caller has closed them, in a mode in which each
/// use still fails. Otherwise the first files that the program opens would take their numbers and receive printed text.
void open_missing_streams() noexcept;

/// Writes a line to standard error. It never throws, because a message must not end a drive.
/// lost_output() reports a failure.
void say(const std::string& line) noexcept;

/// Returns the first failure: "cannot write to standard output: No space left on device"; empty: all was written.
[[nodiscard]] std::string lost_output();

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
  /// Removes the bar, before results are printed. A later show() draws it again.
  void remove();

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

/// Makes SIGINT, SIGTERM and, unless it was ignored before (nohup), SIGHUP set the returned flag. The work can then end
/// in good order. A second signal ends the program at once.
const std::atomic<bool>& stop_on_signals();

/// Returns the signal that arrived; 0: none yet.
int stop_signal();

}  // namespace twocone::cli

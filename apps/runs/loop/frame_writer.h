// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "apps/runs/run.h"

namespace twocone::runs {

/// Stores frames in the order in which they are added, in a thread of its own, so that the loop does not wait while
/// images are compressed and written. A frame that could not be stored is the last one: none after it is written.
/// Use it from one thread.
class FrameWriter {
 public:
  /// The most frames that wait; then add() waits too, so that a slow disk costs time instead of memory.
  static constexpr std::size_t kMostWaiting = 8;

  /// @param store writes a frame; called by the thread. @throws std::system_error if no thread is available
  explicit FrameWriter(std::function<void(const FinishedFrame&)> store);
  /// Stores what waits. A failure that finish() has not reported is logged.
  ~FrameWriter();
  FrameWriter(const FrameWriter&) = delete;
  FrameWriter& operator=(const FrameWriter&) = delete;

  /// Takes a frame, as soon as there is room. @throws what `store` threw for an earlier frame
  void add(FinishedFrame frame);
  /// Waits until all frames are stored. @throws what `store` threw
  void finish();

 private:
  void work();
  void report_failure();

  const std::function<void(const FinishedFrame&)> store_;
  std::mutex mutex_;  // protects all members below but thread_
  std::condition_variable changed_;
  std::deque<FinishedFrame> waiting_;  // its first is being stored
  std::exception_ptr failure_;
  bool is_failure_reported_ = false;
  bool is_ending_ = false;
  std::thread thread_;
};

}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/frame_writer.h"

#include <utility>

#include "base/log.h"

namespace twocone::runs {

FrameWriter::FrameWriter(std::function<void(const FinishedFrame&)> store) : store_(std::move(store)) {
  thread_ = std::thread([this] { work(); });
}

FrameWriter::~FrameWriter() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
  if (!failure_ || is_failure_reported_) return;
  try {
    std::rethrow_exception(failure_);
  } catch (const std::exception& error) {
    base::Logger("run").error(error.what());
  }
}

void FrameWriter::add(FinishedFrame frame) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return failure_ || waiting_.size() < kMostWaiting; });
  report_failure();
  waiting_.push_back(std::move(frame));
  lock.unlock();
  changed_.notify_all();
}

void FrameWriter::finish() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return failure_ || waiting_.empty(); });
  report_failure();
}

void FrameWriter::report_failure() {
  if (!failure_) return;
  is_failure_reported_ = true;
  std::rethrow_exception(failure_);
}

void FrameWriter::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return is_ending_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const FinishedFrame& frame = waiting_.front();  // add() does not move it
    lock.unlock();
    std::exception_ptr failure;
    try {
      store_(frame);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    waiting_.pop_front();
    failure_ = failure;
    changed_.notify_all();
    if (failure_) return;
  }
}

}  // namespace twocone::runs

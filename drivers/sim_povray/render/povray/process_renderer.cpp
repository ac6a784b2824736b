// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray/process_renderer.h"

#include <exception>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/render/povray/povray_answer.h"

namespace twocone::sim_povray {

ProcessRenderer::ProcessRenderer(Povray povray, int processes) : povray_(std::move(povray)), processes_(processes) {}

ProcessRenderer::~ProcessRenderer() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.raise();
  changed_.notify_all();
  for (auto& worker : workers_) worker.join();
  for (auto& [job, done] : waiting_) done(closed_error(job.label, "started"));
}

void ProcessRenderer::submit(RenderJob job, Done done) {
  {
    const std::lock_guard lock(mutex_);
    const bool all_busy = workers_.size() < std::size_t(busy_) + waiting_.size() + 1;
    if (all_busy && workers_.size() < std::size_t(processes_)) {
      try {
        workers_.emplace_back([this] { work(); });
      } catch (const std::system_error& e) {  // the machine has no thread left: the existing ones do it
        if (workers_.empty()) {
          done(Error{ErrorCode::kUnavailable, fmt::format("{}: no thread is available: {}", job.label, e.what())});
          return;
        }
      }
    }
    waiting_.push_back({std::move(job), std::move(done)});
  }
  changed_.notify_one();
}

void ProcessRenderer::work() {
  while (true) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (stopping_) return;
    const Waiting next = std::move(waiting_.front());
    waiting_.pop_front();
    ++busy_;
    lock.unlock();
    ImageResult image = Error{ErrorCode::kUnavailable, next.job.label + ": out of memory"};
    try {
      image = povray_.render(next.job, stop_.fd());
    } catch (const std::exception& e) {  // std::bad_alloc: nothing else is thrown
      image = Error{ErrorCode::kUnavailable, fmt::format("{}: {}", next.job.label, e.what())};
    }
    next.done(std::move(image));
    lock.lock();
    --busy_;
  }
}

}  // namespace twocone::sim_povray

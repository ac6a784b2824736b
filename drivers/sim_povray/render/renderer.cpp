// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/renderer.h"

#include <exception>
#include <utility>

#include <fmt/format.h>

namespace twocone::sim_povray {

ProcessRenderer::ProcessRenderer(Povray povray, int processes) : povray_(std::move(povray)) {
  try {
    for (int i = 0; i < processes; ++i) workers_.emplace_back([this] { work(); });
  } catch (...) {  // no more threads to be had; the destructor of a half-made object does not run
    join();
    throw;
  }
}

ProcessRenderer::~ProcessRenderer() {
  join();
  for (auto& [job, promise] : waiting_) {
    promise.set_value(Error{ErrorCode::kDisconnected,
                            fmt::format("{}: the simulation was closed before POV-Ray had started", job.label)});
  }
}

void ProcessRenderer::join() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.raise();
  changed_.notify_all();
  for (auto& worker : workers_) worker.join();
}

std::shared_future<ImageResult> ProcessRenderer::submit(RenderJob job) {
  Waiting waiting{std::move(job), {}};
  auto future = waiting.promise.get_future().share();
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(waiting));
  }
  changed_.notify_one();
  return future;
}

void ProcessRenderer::work() {
  while (true) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (stopping_) return;
    Waiting next = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    try {
      next.promise.set_value(povray_.render(next.job, stop_.fd()));
    } catch (const std::exception& e) {  // std::bad_alloc: nothing else is thrown
      next.promise.set_value(Error{ErrorCode::kUnavailable, fmt::format("{}: {}", next.job.label, e.what())});
    }
  }
}

}  // namespace twocone::sim_povray

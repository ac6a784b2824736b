// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <thread>
#include <vector>

#include "drivers/sim_povray/render/child_process.h"
#include "drivers/sim_povray/render/povray.h"

namespace twocone::sim_povray {

/// Makes pictures in the background. Every future gets its picture or an error, also when the renderer is destroyed
/// first (kDisconnected).
class Renderer {
 public:
  virtual ~Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Does not wait. Errors of the future: those of Povray::render.
  virtual std::shared_future<ImageResult> submit(RenderJob job) = 0;

 protected:
  Renderer() = default;
};

/// One POV-Ray process per picture, several at one time, begun in the order of submission.
class ProcessRenderer final : public Renderer {
 public:
  /// @param processes at one time, >= 1
  /// @throws std::system_error if the machine has no thread or descriptor left
  ProcessRenderer(Povray povray, int processes);
  /// Kills what is running and gives up what is waiting.
  ~ProcessRenderer() override;

  std::shared_future<ImageResult> submit(RenderJob job) override;

 private:
  struct Waiting {
    RenderJob job;
    std::promise<ImageResult> promise;
  };
  void work();
  void join();

  const Povray povray_;
  StopSignal stop_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> waiting_;
  bool stopping_ = false;
  /// A process is killed by the kernel when the thread that started it ends: so each thread waits for its own.
  std::vector<std::thread> workers_;
};

}  // namespace twocone::sim_povray

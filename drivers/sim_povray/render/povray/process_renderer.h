// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "base/child_process.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/render/renderer.h"

namespace twocone::sim_povray {

/// Renders with one POV-Ray process per image, several at one time, begun in the order of submission. There is no
/// thread before the first submission.
class ProcessRenderer final : public Renderer {
 public:
  /// @param processes at one time, >= 1
  /// @throws std::system_error if the machine has no descriptor left
  ProcessRenderer(Povray povray, int processes);
  /// Kills the running processes and cancels the waiting jobs.
  ~ProcessRenderer() override;

  void submit(RenderJob job, Done done) override;
  [[nodiscard]] std::string describe() const override { return "one POV-Ray process per image"; }

 private:
  struct Waiting {
    RenderJob job;
    Done done;
  };
  void work();

  const Povray povray_;
  const int processes_;
  base::StopSignal stop_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> waiting_;
  int busy_ = 0;
  bool stopping_ = false;
  /// The kernel kills a process when the thread that started it ends: so each thread waits for its own process.
  std::vector<std::thread> workers_;
};

}  // namespace twocone::sim_povray

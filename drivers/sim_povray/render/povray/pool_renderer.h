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
#include "drivers/sim_povray/render/povray/povray_pool.h"
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
  void work();

  const Povray povray_;
  const int processes_;
  base::StopSignal stop_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Order> waiting_;
  int busy_ = 0;
  bool stopping_ = false;
  /// Each thread waits for its own process, because the kernel kills a process when the thread that started it ends.
  std::vector<std::thread> workers_;
};

/// Renders with POV-Ray processes that are held between images: each reads the scene ahead up to the poses and waits
/// there. An image then costs neither the start of a process nor the 0.6 s that POV-Ray sleeps. Pixels are those of
/// ProcessRenderer, to the byte (tests/sim_povray/pool_renderer_test.cpp).
///
/// If processes cannot be held, it works as ProcessRenderer does: for a view template that does not allow it
/// (ViewTemplate::one_shot), and for all from the moment that this machine turns out not to allow it. It starts no
/// thread or process before the first submission.
class PoolRenderer final : public Renderer {
 public:
  /// @param obstacle why this machine cannot hold processes; empty: it can
  /// @throws std::system_error if the machine has no descriptor left
  PoolRenderer(Povray povray, PoolSettings settings, std::string obstacle = lease_obstacle());
  ~PoolRenderer() override;

  void submit(RenderJob job, Done done) override;
  [[nodiscard]] std::string describe() const override;

 private:
  void work();
  /// Runs until it is stopped, or finds that processes cannot be held.
  void hold();
  void fall_back(std::string why, std::vector<Order> orders);
  /// Notifies a person, once, that each image costs a process, and why.
  void give_notice();

  const Povray povray_;
  const PoolSettings settings_;
  ProcessRenderer one_by_one_;
  base::StopSignal wake_;
  mutable std::mutex mutex_;
  std::vector<Order> inbox_;
  std::uint64_t submitted_ = 0;
  bool stopping_ = false;
  std::string obstacle_;
  std::string one_shot_;  ///< reason of the last view template that cannot be held
  bool noticed_ = false;
  std::thread thread_;
};

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/sim_povray/render/child_process.h"
#include "drivers/sim_povray/render/povray_pool.h"
#include "drivers/sim_povray/render/process_renderer.h"
#include "drivers/sim_povray/render/renderer.h"

namespace twocone::sim_povray {

/// POV-Ray processes that stay: they read the scene ahead up to the poses and wait there. A picture then costs neither
/// a process's start nor POV-Ray's sleeping 0.6 s. Pixels are those of ProcessRenderer, to the byte
/// (tests/sim_povray/pool_render_test.cpp).
///
/// Where processes cannot be held, it does as ProcessRenderer does: for a mould that must not (Mould::one_shot), and
/// for all from the moment that this machine turns out not to allow it. No thread or process before the first
/// submission.
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
  /// Until told to stop, or until it turns out that processes cannot be held.
  void hold();
  void fall_back(std::string why, std::vector<Order> orders);
  /// Tells a person, once, that pictures cost a process each, and why.
  void give_notice();

  const Povray povray_;
  const PoolSettings settings_;
  ProcessRenderer one_by_one_;
  StopSignal wake_;
  mutable std::mutex mutex_;
  std::vector<Order> inbox_;
  std::uint64_t submitted_ = 0;
  bool stopping_ = false;
  std::string obstacle_;
  std::string one_shot_;  ///< why the last mould that must not be held must not
  bool noticed_ = false;
  std::thread thread_;
};

}  // namespace twocone::sim_povray

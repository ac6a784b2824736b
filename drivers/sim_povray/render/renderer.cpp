// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/renderer.h"

#include <utility>

#include "drivers/sim_povray/render/povray/pool_renderer.h"
#include "drivers/sim_povray/render/povray/process_renderer.h"
#include "drivers/sim_povray/render_settings.h"

namespace twocone::sim_povray {

std::unique_ptr<Renderer> make_renderer(Povray povray, const RenderSettings& settings) {
  if (!settings.hold) return std::make_unique<ProcessRenderer>(std::move(povray), settings.processes);
  PoolSettings pool;
  pool.processes = settings.processes;
  pool.notice = settings.notice;
  std::string obstacle = povray.hold_obstacle();
  if (obstacle.empty()) obstacle = lease_obstacle();
  return std::make_unique<PoolRenderer>(std::move(povray), pool, std::move(obstacle));
}

}  // namespace twocone::sim_povray

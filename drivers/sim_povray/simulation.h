// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/scene/scene.h"
#include "drivers/sim_povray/sim_povray.h"

namespace twocone::sim_povray {

/// @throws std::invalid_argument naming every bad field
void check(const WorldSettings& settings);
void check(const RenderSettings& settings);

/// A simulation whose pictures come from `renderer`: Simulation::open without its looking for POV-Ray.
/// Errors: kRefused. @throws std::invalid_argument as check() does.
Result<std::unique_ptr<Simulation>> make_simulation(const WorldSettings& settings, Scene scene,
                                                    std::unique_ptr<Renderer> renderer);

}  // namespace twocone::sim_povray

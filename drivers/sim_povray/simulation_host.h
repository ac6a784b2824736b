// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/robot_session.h"
#include "drivers/sim_povray/scene/scene.h"
#include "drivers/sim_povray/sim_povray.h"

namespace twocone::sim_povray {

/// A simulated world with its images and its robots. Simulation::open uses a host alone, and a server shares one. Both
/// run the same code and therefore get the same bytes. Any thread.
///
/// Lock-step: the world steps once every session has requested it. When the last robot leaves, the world returns to
/// time 0, so that the next run gets the same images as from a world of its own.
class SimulationHost {
 public:
  /// Errors: as Simulation::open. @throws std::invalid_argument naming every bad field
  static Result<std::shared_ptr<SimulationHost>> open(const PlaceSettings& place);
  /// The same with images from `renderer`: does not search for POV-Ray, and renders whole images.
  static Result<std::shared_ptr<SimulationHost>> open(const PlaceSettings& place, const Scene& scene,
                                                      std::unique_ptr<Renderer> renderer);

  virtual ~SimulationHost() = default;
  SimulationHost(const SimulationHost&) = delete;
  SimulationHost& operator=(const SimulationHost&) = delete;

  /// Lets a robot join. The session keeps its host alive. Errors: kRefused: the scene has no such robot; it is taken;
  /// or it touches something at its initial pose. @throws std::invalid_argument naming every bad field
  virtual Result<std::unique_ptr<RobotSession>> join(const SessionSettings& settings) = 0;

  /// Returns one line about how images are rendered, for the run's record: "POV-Ray processes are held between images".
  [[nodiscard]] virtual std::string rendering() const = 0;

 protected:
  SimulationHost() = default;
};

}  // namespace twocone::sim_povray

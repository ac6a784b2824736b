// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/scene/scene.h"
#include "drivers/sim_povray/seat.h"
#include "drivers/sim_povray/sim_povray.h"

namespace twocone::sim_povray {

/// A world with its pictures, and the robots in it: what Simulation::open has to itself and a server shares out. The
/// same code either way, so the same bytes. Any thread.
///
/// Lock-step: the world steps once every seat has asked. When the last robot leaves, the world begins anew at time 0,
/// so that the next run sees what a world of its own would show it.
class Hall {
 public:
  /// Errors: as Simulation::open. @throws std::invalid_argument naming every bad field
  static Result<std::shared_ptr<Hall>> open(const PlaceSettings& place);
  /// The same with pictures from `renderer`: no looking for POV-Ray, and whole pictures.
  static Result<std::shared_ptr<Hall>> open(const PlaceSettings& place, const Scene& scene,
                                            std::unique_ptr<Renderer> renderer);

  virtual ~Hall() = default;
  Hall(const Hall&) = delete;
  Hall& operator=(const Hall&) = delete;

  /// A seat keeps its hall alive. Errors: kRefused: the scene has no such robot; it is taken; where it begins touches
  /// something. @throws std::invalid_argument naming every bad field
  virtual Result<std::unique_ptr<Seat>> take_seat(const SeatSettings& settings) = 0;

  /// One line about how pictures are rendered, for the run's record: "POV-Ray processes are held between pictures".
  [[nodiscard]] virtual std::string rendering() const = 0;

 protected:
  Hall() = default;
};

}  // namespace twocone::sim_povray

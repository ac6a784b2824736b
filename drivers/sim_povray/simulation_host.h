// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <string>

#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/robot_session.h"
#include "drivers/sim_povray/session_settings.h"
#include "hal/image.h"
#include "hal/result.h"

namespace twocone::sim_povray {

class Renderer;
class Scene;

/// A simulated world with its images and its robots. Simulation::open uses a host alone, and a server shares one. Both
/// run the same code and therefore get the same bytes. A host may be used from any thread.
///
/// Lock-step: the world steps once every session has requested it. When the last robot leaves, the world returns to
/// time 0, so that the next run gets the same images as from a world of its own. The located mirrors and the POV-Ray
/// processes are kept. Images ordered by a robot that has left are still delivered.
class SimulationHost {
 public:
  /// Errors: as Simulation::open. @throws std::invalid_argument naming every bad field
  static Result<std::shared_ptr<SimulationHost>> open(const PlaceSettings& place);
  /// Opens a world whose images `renderer` makes: does not search for POV-Ray, and renders whole images.
  static Result<std::shared_ptr<SimulationHost>> open(const PlaceSettings& place, const Scene& scene,
                                                      std::unique_ptr<Renderer> renderer);

  virtual ~SimulationHost() = default;
  SimulationHost(const SimulationHost&) = delete;
  SimulationHost& operator=(const SimulationHost&) = delete;

  /// Lets a robot join. The session keeps its host alive. Errors: kRefused (the scene has no such robot, it is taken,
  /// its map is not that of the world, or it touches something at its initial pose), kUnavailable (physics in a build
  /// without it).
  /// @throws std::invalid_argument naming every bad field
  virtual Result<std::unique_ptr<RobotSession>> join(const SessionSettings& settings) = 0;

  /// Returns an empty world to time 0 for the next episode of a sweep, whose robot gets the same images as from
  /// Simulation::open. Errors: kRefused (the simulation, cameras, drive or truth of a robot still exist).
  virtual Status reset() = 0;

  /// Describes in one line how images are rendered, for the run's record: "POV-Ray processes are held between images".
  [[nodiscard]] virtual std::string rendering() const = 0;

 protected:
  SimulationHost() = default;
};

/// Watches a served world. The threads of its robots call these and wait for them. Each may be empty.
struct WorldWatch {
  std::function<void(const std::string& robot, const SessionState& state)> stepped{};
  /// @param image of the robot's present step, as soon as it is there
  std::function<void(const std::string& robot, const std::string& camera, const std::shared_future<ImageResult>& image)>
      ordered{};
  std::function<void(const std::string& robot)> left{};
};

/// Runs a world for other programs of the same user on this machine until `stop` is set. They attach to it by `name`
/// (Simulation::attach). The world steps when every attached robot has requested its next frame; when the last one has
/// left, it returns to time 0. If a program dies, its robot stays where it is, and the others continue. The same holds
/// for a program that requests nothing for 30 s while others wait for it.
/// @param name letters, digits, - and _, at most 64
/// @param report one line for a person when the world is ready and whenever a robot joins or leaves; from several
/// threads, one at a time
/// Errors: as Simulation::open; kRefused (the name is already served; the runtime folder belongs to another user),
/// kUnavailable (no socket is available). @throws std::invalid_argument naming every bad field of `place`
Status serve_world(const PlaceSettings& place, const std::string& name,
                   const std::function<void(const std::string&)>& report, const std::atomic<bool>& stop,
                   const WorldWatch& watch = {});

}  // namespace twocone::sim_povray

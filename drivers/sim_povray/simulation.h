// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/session_settings.h"
#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/result.h"
#include "hal/robot.h"

/// A simulated world behind Camera and DiffDrive, rendered by POV-Ray.
///
/// Truth and belief are kept apart: nothing here reads the robot file's `rig:`, and no setting below comes from it.
namespace twocone::sim_povray {

class RobotSession;
struct SharedSession;
class SimulationHost;

/// One robot in one world, which the robot's cameras step in lock-step. A grab returns the image of the world's present
/// step if that camera has not returned it yet; otherwise it first advances the world by one frame period. Two cameras
/// that are grabbed in turn therefore see the same step. The drive and the truth never advance the world. A simulation
/// must be used by one thread at a time.
///
/// Step 0, at time 0, is the start; a frame's sequence number is the number of its step. Camera::grab fails with
/// kTimeout, and nothing moves, if `run_ahead_frames` steps are still unfinished at its deadline. Cameras, drives and
/// truths may outlive the simulation that opened them. When the last of these objects is destroyed, unfinished images
/// end as kDisconnected.
class Simulation {
 public:
  /// Opens a world inside this program. Reads and checks the scene, and searches for POV-Ray. The scene file is not
  /// read again; the files that it includes are read for every image. Errors that only POV-Ray finds in the scene are
  /// reported with the first image: `FILE:LINE: POV-Ray: ...`
  ///
  /// Errors: kNotFound (no such scene, or no such folder of scene_paths), kUnavailable (no POV-Ray, or physics in a
  /// build without it), kRefused (the scene: file, line, column and the name that was searched for; or those of
  /// SimulationHost::join).
  ///
  /// @throws std::invalid_argument naming every bad field
  static Result<std::unique_ptr<Simulation>> open(const PlaceSettings& place, const SessionSettings& session);

  /// Joins a world of this program. Cameras, drive and truth keep the host alive.
  /// Errors and exceptions: as SimulationHost::join.
  static Result<std::unique_ptr<Simulation>> join(SimulationHost& host, const SessionSettings& session);

  /// Joins a world that `serve_world` runs under `name`, on this machine and of this user.
  /// Errors: kNotFound (no program serves it), kRefused (another version, another user, and those of
  /// SimulationHost::join), kTimeout, kDisconnected, kUnavailable, kBadData (it is not this program).
  /// @throws std::invalid_argument as above
  static Result<std::unique_ptr<Simulation>> attach(const std::string& name, const SessionSettings& session);

  /// Opens a camera of the scene that is mounted on the robot. All cameras of a world must be configured with one rate:
  /// configure() and start() return kRefused if another camera, configured or streaming, holds a different rate. A
  /// stopped camera holds none.
  ///
  /// Errors: kRefused (no such camera in the scene, or two), kDisconnected.
  ///
  /// @throws std::invalid_argument naming every bad field of `view`
  Result<std::unique_ptr<Camera>> open_camera(const ViewSettings& view);
  std::unique_ptr<DiffDrive> open_drive();
  std::unique_ptr<GroundTruth> open_truth();

 private:
  Simulation(std::unique_ptr<RobotSession> session, const SessionSettings& settings);

  std::shared_ptr<SharedSession> shared_;
};

}  // namespace twocone::sim_povray

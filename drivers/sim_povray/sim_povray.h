// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/pose.h"
#include "hal/robot.h"

/// A world rendered by POV-Ray behind Camera and DiffDrive.
///
/// Belief and truth are kept apart: nothing here knows the robot file's `rig:`, and no setting below comes from it.
namespace twocone::sim_povray {

/// The wheels as they really are.
struct WheelSettings {
  double separation_m = 0.30;  ///< between the wheels' contact points, > 0
  double radius_m = 0.05;      ///< > 0
  /// Standard deviation of each wheel's relative slip, >= 0 (0: none): the wheel's way over the floor is
  /// (1 + slip) times its turning. A first-order Gauss-Markov process, one per wheel, of stationary deviation `slip`.
  double slip = 0;
  double slip_correlation_s = 2.0;  ///< time constant of that process, > 0
  int encoder_counts_per_turn = 0;  ///< what read_angles() is rounded down to; 0: exact angles
};

/// How to have pictures rendered. Defaults suit two cores.
struct RenderSettings {
  std::string povray = "povray";  ///< the program: a path, or a name looked up in PATH
  int processes = 8;              ///< POV-Ray processes at one time, >= 1: more than cores, as each sleeps 0.6 s
  int run_ahead_frames = 6;       ///< instants whose pictures may be unfinished before a grab waits, >= 1
  std::chrono::milliseconds timeout{120'000};  ///< for one picture, > 0: then the process is killed
};

/// One robot in one scene.
struct WorldSettings {
  std::filesystem::path scene;       ///< a POV-Ray file
  double unit_m = 0.05;              ///< metres in one POV-Ray unit, > 0
  std::string robot_name = "robot";  ///< `//*PMName` of the robot's object
  Pose2 start;                       ///< where the scene shows the robot standing; the heading is wrapped to (-pi, pi]
  WheelSettings wheels;
  DriveLimits drive;
  RenderSettings render;
  std::uint64_t seed = 1;  ///< of every random process of the world
};

/// What a camera of the scene is asked for beyond CameraSettings.
struct ViewSettings {
  std::string camera_name;  ///< `//*PMName` of the camera: lower, upper
  /// 1 to 9 rays per pixel side, on a regular grid, wherever a pixel differs from its neighbours by more than 0.03
  /// (POV-Ray's +AM1 +A0.03 +R); 1: one ray through the pixel's centre, no anti-aliasing. Costs at 640 x 480: 1: 0.3 s,
  /// 3: 1 s.
  int antialias = 1;
};

/// One world, stepped in lock-step by the cameras that look at it: a grab hands out the world's present instant if that
/// camera has not had it yet, and otherwise advances the world by one frame period first. So two cameras that are
/// grabbed in turn see one instant. The drive and the truth never advance it. One thread at a time.
///
/// Instant 0, at time 0, is the start; a frame's sequence number is its instant's. Camera::grab fails with kTimeout,
/// and nothing moves, when `run_ahead_frames` instants are still unfinished at its deadline. What opens from a
/// simulation may outlive it; when the last such object goes, pictures still on their way end as kDisconnected.
class Simulation {
 public:
  /// Reads and checks the scene and looks for POV-Ray. The scene file is not read again (files that it includes are,
  /// for every picture). What only POV-Ray finds wrong in it comes with the first picture: `FILE:LINE: POV-Ray: ...`
  ///
  /// Errors: kNotFound (no such scene), kUnavailable (no POV-Ray), kRefused (the scene: file, line, column, what was
  /// looked for).
  ///
  /// @throws std::invalid_argument naming every bad field of `settings`
  static Result<std::unique_ptr<Simulation>> open(const WorldSettings& settings);

  virtual ~Simulation() = default;

  /// A camera of the scene that rides on the robot. All cameras of a world must be configured with one rate:
  /// configure() and start() answer kRefused where another camera, configured or streaming, holds a different one; a
  /// stopped camera holds none.
  ///
  /// Errors: kRefused (no such camera in the scene, or two).
  ///
  /// @throws std::invalid_argument naming every bad field of `view`
  virtual Result<std::unique_ptr<Camera>> open_camera(const ViewSettings& view) = 0;
  virtual std::unique_ptr<DiffDrive> open_drive() = 0;
  virtual std::unique_ptr<GroundTruth> open_truth() = 0;
};

/// A picture of the whole scene from straight above, for reports: an orthographic view of a world rectangle, world x to
/// the right and y up, from `height_m` above the floor; what is higher is not seen.
struct OverheadView {
  double min_x_m = 0, max_x_m = 0;
  double min_y_m = 0, max_y_m = 0;
  double height_m = 2.0;
  int width_px = 1000;  ///< the height follows from the rectangle
};
/// The robot stands where the scene shows it; a scene without names will do. Errors: as Simulation::open and
/// Frame::image.
/// @throws std::invalid_argument naming every bad argument
Result<Image> render_overhead(const std::filesystem::path& scene, double unit_m, const OverheadView& view,
                              const RenderSettings& render);

}  // namespace twocone::sim_povray

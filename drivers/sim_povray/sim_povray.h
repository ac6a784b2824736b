// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

#include "base/plane.h"
#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/robot.h"

/// A simulated world behind Camera and DiffDrive, rendered by POV-Ray.
///
/// Truth and belief are kept apart: nothing here reads the robot file's `rig:`, and no setting below comes from it.
namespace twocone::sim_povray {

// ---- the place

using Outline = std::vector<FloorPoint>;  ///< corners of a simple polygon, at least three

/// An obstacle that stands on the floor and stops a robot.
struct Solid {
  std::string name;  ///< name in messages: "landmark red", "obstacle 3"
  std::variant<Disc, Outline> shape{};
};

/// An object that moves along a path by itself. It is at path_m[0] at time 0, faces along its path and moves at
/// constant speed. If it loops, it returns to the first point on a straight line; otherwise it stops at the last point.
/// The scene shows it at path_m[0], facing along the first segment, as the object `moving.NAME`.
struct MovingThing {
  std::string name;                  ///< without `moving.`
  std::vector<FloorPoint> path_m{};  ///< at least two points, no two neighbours equal
  double speed_mps = 0;              ///< > 0
  bool loop = false;
  double radius_m = 0;  ///< radius of the disc that stops a robot, > 0
};

/// Rendering effects that the map switches off or changes, although the scene's text uses them.
struct SceneSwitches {
  bool shadows = true;
  bool area_lights = true;  ///< off: a point light at the area's centre
  bool photons = true;
  bool radiosity = true;
  bool media = true;                      ///< media and fog
  std::optional<int> reflection_depth{};  ///< replaces the scene's max_trace_level, 1 to 256

  friend bool operator==(const SceneSwitches&, const SceneSwitches&) = default;
};

/// How images are rendered. The defaults suit two cores.
struct RenderSettings {
  std::string povray = "povray";  ///< the program: a path, or a name looked up in PATH
  int processes = 8;              ///< POV-Ray processes at one time, >= 1; more than cores, as each sleeps at times
  bool hold = true;               ///< keep processes between images; off: one process per image
  bool whole_image = false;       ///< also render the pixels outside the mirror
  bool landlock = true;           ///< confine POV-Ray by Landlock if the kernel has it; off: as on a kernel without
  std::chrono::milliseconds timeout{120'000};  ///< time limit of one image, > 0; then the process is killed
  /// Called from any thread with a line for a person: rendering fell back to a slower method, and why.
  std::function<void(const std::string&)> notice{};
};

/// A scene with everything in it except robots.
struct PlaceSettings {
  std::filesystem::path scene;  ///< a POV-Ray file
  /// Folders that the scene may read, with all their sub-folders, in addition to POV-Ray's libraries. The scene may not
  /// write any file. Empty: the scene's own folder.
  std::vector<std::filesystem::path> scene_paths{};
  double unit_m = 0.05;           ///< metres in one POV-Ray unit, > 0
  std::optional<Bounds> walls{};  ///< positions of the inner faces
  std::vector<Solid> solids{};
  std::vector<MovingThing> moving{};
  SceneSwitches switches{};
  RenderSettings render{};
};

// ---- a robot

/// True properties of the wheels.
struct WheelSettings {
  double separation_m = 0.30;  ///< between the wheels' contact points, > 0
  double radius_m = 0.05;      ///< > 0
  /// Standard deviation of each wheel's relative slip, >= 0 (0: none): a wheel's path over the floor is (1 + slip)
  /// times its turning. The slip is a first-order Gauss-Markov process, one per wheel, of stationary standard deviation
  /// `slip`.
  double slip = 0;
  double slip_correlation_s = 2.0;  ///< time constant of that process, > 0
  int encoder_counts_per_turn = 0;  ///< read_angles() rounds down to counts; 0: exact angles
  /// Time constant of the actuators, >= 0 (0: none): a wheel's speed w follows its command u by w' = (u - w) / lag.
  double lag_s = 0;
};

/// Mass and friction. The physics engine moves a robot that has them.
struct Physics {
  double mass_kg = 5.0;  ///< > 0; the moment of inertia is that of a uniform disc of the body's radius
  double wheel_friction =
      0.8;                     ///< Coulomb coefficient between wheel and floor, > 0; each wheel carries half the weight
  double body_friction = 0.3;  ///< between the body and the objects that it touches, >= 0
};

/// The part of a robot that the world moves.
struct RobotBody {
  std::string name = "robot";  ///< name in the messages of other robots
  Pose2 start;                 ///< pose at which the scene shows the robot; the heading is wrapped to (-pi, pi]
  double radius_m = 0;         ///< radius of the disc for contacts, >= 0; 0: it touches nothing
  WheelSettings wheels;
  std::chrono::nanoseconds command_timeout{500'000'000};  ///< dead-man time, > 0
  std::optional<Physics> physics{};
  std::uint64_t seed = 1;  ///< seed of all random processes of this robot
  /// Pose at time 0, if it differs from `start`.
  std::optional<Pose2> begin{};
  std::string start_place{};  ///< source of `start`, for messages: "robots/lab_sim.yaml:17"; empty: unknown
};

/// Resources that POV-Ray used for one rendered image.
struct RenderedImage {
  std::string camera;               ///< its ViewSettings::camera_name
  std::uint64_t step = 0;           ///< number of the image's step
  std::chrono::nanoseconds cpu{0};  ///< processor time of all threads; the first image of a process includes its start
  std::uint64_t peak_bytes = 0;     ///< peak memory of its process so far; 0: unknown
};

/// A robot that joins a world.
struct SessionSettings {
  /// The robot's name in the scene. It selects the object `robot.NAME` with the cameras `VIEW.NAME` or, if the scene
  /// has no such object, `robot` with the cameras `VIEW`.
  std::string name;
  RobotBody body;  ///< the claimed object's name replaces its name
  DriveLimits drive;
  /// Outline of the place according to the robot's map, as outline_of() writes it. A world with a different outline
  /// refuses the robot. Empty: unknown.
  std::string map_outline{};
  int run_ahead_frames = 6;  ///< steps whose images may be unfinished before a grab waits, >= 1
  /// Called from any thread after each image is rendered (several times for an image that is averaged from shutter
  /// samples), before the frame is ready. Must neither block nor throw, and may be called after the robot has left. Not
  /// called for the renderings that locate a mirror, for images of a world that another program serves, or where the
  /// system does not report the use.
  std::function<void(const RenderedImage&)> rendered{};
  /// Returns the finished image that a camera (by ViewSettings::camera_name) took at a step of an equal world before.
  /// The camera then hands out this image and renders none. Null: there is none. Called by grab().
  std::function<std::shared_ptr<const Image>(const std::string& camera, std::uint64_t step)> stored{};
};

/// Length of the history of poses that a world stores, in addition to its last step.
constexpr double kMaxStampLate_s = 0.5;

/// Deviations of a simulated camera from an ideal one. Zero or empty: the effect is off and costs no time.
struct CameraEffects {
  double gain = 1;                  ///< exposure and gain: factor on linear light, > 0
  double full_well_electrons = 0;   ///< shot noise: electrons of a full-scale pixel, >= 0
  double read_noise_electrons = 0;  ///< standard deviation, >= 0; needs full_well_electrons
  double vignetting = 0;            ///< share of light lost in the corners, 0 to 1; grows as the radius squared
  double defocus_px = 0;            ///< radius of the circle of confusion, >= 0
  double exposure_time_s = 0;       ///< shutter time, >= 0: motion blur
  double readout_s = 0;             ///< from the first row's exposure to the last row's, >= 0: rolling shutter
  int shutter_samples = 8;          ///< renderings per image with motion blur or rolling shutter, 2 to 64
  /// k1 k2 p1 p2 [k3] of OpenCV's lens model about the image's centre, with focal length distortion_focal_px; empty: no
  /// distortion.
  std::vector<double> distortion{};
  double distortion_focal_px = 0;  ///< > 0 if there is a distortion
  double drop_probability = 0;     ///< that a frame is lost, 0 to < 1
  double late_probability = 0;     ///< that a frame arrives one period late, 0 to < 1
  /// Delay of the stamp against the exposure: the image is older than its stamp states, and nothing reports this to the
  /// program. In one camera of a pair it acts as a hidden skew, in both as a latency. 0 to kMaxStampLate_s; 0: none.
  double stamp_late_s = 0;

  friend bool operator==(const CameraEffects&, const CameraEffects&) = default;
};

/// Settings of a camera of the scene in addition to CameraSettings.
struct ViewSettings {
  std::string camera_name;  ///< `lower`, `upper`: its `//*PMName`, without the robot's name
  /// Rays per pixel side, 1 to 9, on a regular grid, wherever a pixel differs from its neighbours by more than 0.03
  /// (POV-Ray's +AM1 +A0.03 +R). 1: one ray through the pixel's centre, no anti-aliasing. Cost at 640 x 480: 0.3 s for
  /// 1, 1 s for 3.
  int antialias = 1;
  CameraEffects effects{};
};

// ---- the simulation

/// One robot in one world, which the robot's cameras step in lock-step. A grab returns the image of the world's present
/// step if that camera has not returned it yet; otherwise it first advances the world by one frame period. Two cameras
/// that are grabbed in turn therefore see the same step. The drive and the truth never advance the world. One thread at
/// a time.
///
/// Step 0, at time 0, is the start; a frame's sequence number is the number of its step. Camera::grab fails with
/// kTimeout, and nothing moves, if `run_ahead_frames` steps are still unfinished at its deadline. Cameras, drives and
/// truths may outlive the simulation that opened them; when the last of these objects is destroyed, unfinished images
/// end as kDisconnected.
class Simulation {
 public:
  /// Opens a world inside this program. Reads and checks the scene, and searches for POV-Ray. The scene file is not
  /// read again; the files that it includes are read for every image. Errors that only POV-Ray finds in the scene are
  /// reported with the first image: `FILE:LINE: POV-Ray: ...`
  ///
  /// Errors: kNotFound (no such scene), kUnavailable (no POV-Ray), kRefused (the scene: file, line, column and the name
  /// that was searched for; or the robot touches something at its initial pose).
  ///
  /// @throws std::invalid_argument naming every bad field
  static Result<std::unique_ptr<Simulation>> open(const PlaceSettings& place, const SessionSettings& session);

  /// Joins a world that `serve_world` runs under `name`, on this machine and of this user.
  /// Errors: kNotFound (no program serves it), kRefused (another version, another user, the robot is taken), kTimeout,
  /// kDisconnected. @throws std::invalid_argument as above
  static Result<std::unique_ptr<Simulation>> attach(const std::string& name, const SessionSettings& session);

  virtual ~Simulation() = default;

  /// Opens a camera of the scene that is mounted on the robot. All cameras of a world must be configured with one rate:
  /// configure() and start() return kRefused if another camera, configured or streaming, holds a different rate. A
  /// stopped camera holds none.
  ///
  /// Errors: kRefused (no such camera in the scene, or two).
  ///
  /// @throws std::invalid_argument naming every bad field of `view`
  virtual Result<std::unique_ptr<Camera>> open_camera(const ViewSettings& view) = 0;
  virtual std::unique_ptr<DiffDrive> open_drive() = 0;
  virtual std::unique_ptr<GroundTruth> open_truth() = 0;
};

/// A world that several robots enter, one after the other; one thread at a time. The located mirrors and the POV-Ray
/// processes are kept from one robot to the next. Each robot finds the world at time 0 and gets the same images as from
/// Simulation::open. Images ordered by a robot that has left are still delivered.
class ReusedHost {
 public:
  /// Errors and exceptions: as Simulation::open.
  static Result<ReusedHost> open(const PlaceSettings& place);
  ~ReusedHost();
  ReusedHost(ReusedHost&&) noexcept;
  ReusedHost& operator=(ReusedHost&&) noexcept;

  /// Errors: kRefused: the scene has no such robot; the initial pose touches something; or the last robot's simulation,
  /// cameras, drive or truth still exist.
  /// @throws std::invalid_argument naming every bad field
  [[nodiscard]] Result<std::unique_ptr<Simulation>> enter(const SessionSettings& session) const;

 private:
  class Impl;
  explicit ReusedHost(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Describes the walls, solids and moving things of a place in text, one line each, to a millimetre. The programs of
/// one world must agree on it. At most 4 kB: a checksum replaces the lines beyond that.
std::string outline_of(const PlaceSettings& place);

/// @throws std::invalid_argument naming every bad field
void check(const PlaceSettings& settings);
void check(const SessionSettings& settings);
void check(const ViewSettings& settings);
void check(const RenderSettings& settings);

/// Position of a camera over the floor, as the scene shows it.
struct ShownCamera {
  double x_m = 0, y_m = 0;
  /// Direction of the image's x axis in the world; empty if that axis is not level within a degree.
  std::optional<double> x_axis_rad{};
};
/// Returns the position of a camera of the robot that SessionSettings::name selects. POV-Ray evaluates the camera's
/// statement without rendering an image. Ends early when stop is requested.
/// Errors: as Simulation::open; kRefused, with the reason, if the statement cannot be evaluated (the camera is of
/// another kind, takes its vectors from another camera, or its statement holds a directive).
Result<ShownCamera> shown_camera(const PlaceSettings& place, const std::string& robot_name,
                                 const std::string& camera_name, const std::stop_token& stop);

/// An image of the whole scene from straight above, for reports: an orthographic view of a world rectangle, with world
/// x to the right and y up, from `height_m` above the floor. Objects above that height are not seen.
struct OverheadView {
  double min_x_m = 0, max_x_m = 0;
  double min_y_m = 0, max_y_m = 0;
  double height_m = 2.0;
  int width_px = 1000;  ///< the height follows from the rectangle
};
/// Renders the overhead view. The robot stands where the scene shows it; the scene needs no name comments.
/// Errors: as Simulation::open and Frame::image.
/// @param scene_paths as PlaceSettings
/// @throws std::invalid_argument naming every bad argument
Result<Image> render_overhead(const std::filesystem::path& scene, double unit_m, const OverheadView& view,
                              const RenderSettings& render, const std::vector<std::filesystem::path>& scene_paths = {});

}  // namespace twocone::sim_povray

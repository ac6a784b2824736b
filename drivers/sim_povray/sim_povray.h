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

#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/pose.h"
#include "hal/robot.h"

/// A world rendered by POV-Ray behind Camera and DiffDrive.
///
/// Belief and truth are kept apart: nothing here knows the robot file's `rig:`, and no setting below comes from it.
namespace twocone::sim_povray {

// ---- the place

struct FloorPoint {
  double x_m = 0;
  double y_m = 0;
  friend bool operator==(const FloorPoint&, const FloorPoint&) = default;
};
struct Disc {
  FloorPoint centre;
  double radius_m = 0;  ///< > 0
};
using Outline = std::vector<FloorPoint>;  ///< corners of a simple polygon, at least three

/// Something that stands on the floor and stops a robot.
struct Solid {
  std::string name;  ///< as messages call it: "landmark red", "obstacle 3"
  std::variant<Disc, Outline> shape{};
};

/// Inner faces of the walls, min < max.
struct Walls {
  double min_x_m = 0, max_x_m = 0;
  double min_y_m = 0, max_y_m = 0;
};

/// Something that goes along a path by itself: at path_m[0] at time 0, facing along its path, at constant speed; back
/// to the first point by a straight line if it loops, else it stands at the last. The scene shows it at path_m[0],
/// facing along the first leg, as the object `moving.NAME`.
struct MovingThing {
  std::string name;                  ///< without `moving.`
  std::vector<FloorPoint> path_m{};  ///< at least two points, no two neighbours equal
  double speed_mps = 0;              ///< > 0
  bool loop = false;
  double radius_m = 0;  ///< of the disc that stops a robot, > 0
};

/// Rendering effects that the map switches off or changes, though the scene's text calls for them.
struct SceneSwitches {
  bool shadows = true;
  bool area_lights = true;  ///< off: a point light at the area's centre
  bool photons = true;
  bool radiosity = true;
  bool media = true;                      ///< media and fog
  std::optional<int> reflection_depth{};  ///< POV-Ray's max_trace_level, 1 to 256, in place of the scene's

  friend bool operator==(const SceneSwitches&, const SceneSwitches&) = default;
};

/// How to have pictures rendered. Defaults suit two cores.
struct RenderSettings {
  std::string povray = "povray";  ///< the program: a path, or a name looked up in PATH
  int processes = 8;              ///< POV-Ray processes at one time, >= 1: more than cores, as each sleeps now and then
  bool hold = true;               ///< keep processes between pictures; off: one process per picture
  bool whole_picture = false;     ///< also trace what is outside the mirror
  bool landlock = true;           ///< confine POV-Ray by Landlock where the kernel has it; off: as on a kernel without
  std::chrono::milliseconds timeout{120'000};  ///< for one picture, > 0: then the process is killed
  /// Told, from any thread, what a person should know of the rendering: that it fell back to a slower way, and why.
  std::function<void(const std::string&)> notice{};
};

/// A scene with all that is in it but robots.
struct PlaceSettings {
  std::filesystem::path scene;  ///< a POV-Ray file
  /// Folders that the scene may read, with all below them, beside POV-Ray's libraries; it may write nothing. Empty: the
  /// scene's own folder.
  std::vector<std::filesystem::path> scene_paths{};
  double unit_m = 0.05;  ///< metres in one POV-Ray unit, > 0
  std::optional<Walls> walls{};
  std::vector<Solid> solids{};
  std::vector<MovingThing> moving{};
  SceneSwitches switches{};
  RenderSettings render{};
};

// ---- a robot

/// The wheels as they really are.
struct WheelSettings {
  double separation_m = 0.30;  ///< between the wheels' contact points, > 0
  double radius_m = 0.05;      ///< > 0
  /// Standard deviation of each wheel's relative slip, >= 0 (0: none): the wheel's way over the floor is
  /// (1 + slip) times its turning. A first-order Gauss-Markov process, one per wheel, of stationary deviation `slip`.
  double slip = 0;
  double slip_correlation_s = 2.0;  ///< time constant of that process, > 0
  int encoder_counts_per_turn = 0;  ///< what read_angles() is rounded down to; 0: exact angles
  /// Time constant of the actuators, >= 0 (0: none): a wheel's speed w follows its command u by w' = (u - w) / lag.
  double lag_s = 0;
};

/// Mass and friction: what makes a robot one for the physics engine.
struct Physics {
  double mass_kg = 5.0;  ///< > 0; the moment of inertia is that of a uniform disc of the body's radius
  double wheel_friction =
      0.8;                     ///< Coulomb coefficient between wheel and floor, > 0; each wheel carries half the weight
  double body_friction = 0.3;  ///< between the body and what it touches, >= 0
};

/// What of a robot the world moves.
struct RobotBody {
  std::string name = "robot";  ///< as messages of others call it
  Pose2 start;                 ///< where the scene shows the robot standing; the heading is wrapped to (-pi, pi]
  double radius_m = 0;         ///< of the disc that touches things, >= 0; 0: it touches nothing
  WheelSettings wheels;
  std::chrono::nanoseconds command_timeout{500'000'000};  ///< dead-man time, > 0
  std::optional<Physics> physics{};
  std::uint64_t seed = 1;  ///< of every random process of this robot
  /// Where it stands at time 0, if that is not `start`.
  std::optional<Pose2> begin{};
  std::string start_place{};  ///< where `start` is written, for messages: "robots/lab_sim.yaml:17"; empty: unknown
};

/// What one rendered picture took of POV-Ray.
struct RenderedPicture {
  std::string camera;               ///< its ViewSettings::camera_name
  std::uint64_t tick = 0;           ///< number of its instant
  std::chrono::nanoseconds cpu{0};  ///< processor time of all threads; a process's first picture includes its start
  std::uint64_t peak_bytes = 0;     ///< most memory that its process has held until then; 0: not known
};

/// One robot that wants a place in a world.
struct SeatSettings {
  /// The robot's name in the scene: claims the object `robot.NAME` with the cameras `VIEW.NAME`, or `robot` with `VIEW`
  /// where the scene has no such object.
  std::string name;
  RobotBody body;  ///< its name is replaced by the claimed object's
  DriveLimits drive;
  /// What the robot's map says of the place, as outline_of() writes it; a world whose own differs refuses the robot.
  /// Empty: not known.
  std::string map_outline{};
  int run_ahead_frames = 6;  ///< instants whose pictures may be unfinished before a grab waits, >= 1
  /// Told, from any thread, of each rendered picture (several for one that takes time to expose), before the frame is
  /// ready. Must neither block nor throw, and may be called after the robot has left. Not told: pictures by which a
  /// mirror is found; those of a world that another program serves; any where the system does not tell.
  std::function<void(const RenderedPicture&)> rendered{};
  /// The finished image that a camera (by ViewSettings::camera_name) took at an instant of an equal world before: it is
  /// handed out, and none is rendered. Null: there is none. Called by grab().
  std::function<std::shared_ptr<const Image>(const std::string& camera, std::uint64_t tick)> stored{};
};

/// So far back a world knows where everything was, beside its last step.
constexpr double kMaxStampLate_s = 0.5;

/// What a simulated camera does beyond the ideal. Zero or empty: not there, and not paid for.
struct CameraEffects {
  double gain = 1;                  ///< exposure and gain: factor on linear light, > 0
  double full_well_electrons = 0;   ///< shot noise: electrons of a full-scale pixel, >= 0
  double read_noise_electrons = 0;  ///< standard deviation, >= 0; needs full_well_electrons
  double vignetting = 0;            ///< share of light lost in the corners, 0 to 1; grows as the radius squared
  double defocus_px = 0;            ///< radius of the circle of confusion, >= 0
  double exposure_s = 0;            ///< shutter time, >= 0: motion blur
  double readout_s = 0;             ///< from the first row's exposure to the last row's, >= 0: rolling shutter
  int exposures = 8;                ///< pictures that one with motion blur or rolling shutter is made of, 2 to 64
  /// k1 k2 p1 p2 [k3] of OpenCV's lens model about the picture's centre, with focal length distortion_focal_px; empty:
  /// none.
  std::vector<double> distortion{};
  double distortion_focal_px = 0;  ///< > 0 where there is a distortion
  double drop_probability = 0;     ///< of a frame's being lost, 0 to < 1
  double late_probability = 0;     ///< of a frame's coming one period late, 0 to < 1
  /// The stamp is so much later than the exposure: what the picture shows is older than it says, and nothing tells the
  /// program. In one camera of a pair a hidden skew, in both a latency. 0 to kMaxStampLate_s; 0: none.
  double stamp_late_s = 0;

  friend bool operator==(const CameraEffects&, const CameraEffects&) = default;
};

/// What a camera of the scene is asked for beyond CameraSettings.
struct ViewSettings {
  std::string camera_name;  ///< `lower`, `upper`: its `//*PMName`, without the robot's name
  /// 1 to 9 rays per pixel side, on a regular grid, wherever a pixel differs from its neighbours by more than 0.03
  /// (POV-Ray's +AM1 +A0.03 +R); 1: one ray through the pixel's centre, no anti-aliasing. Costs at 640 x 480: 1: 0.3 s,
  /// 3: 1 s.
  int antialias = 1;
  CameraEffects effects{};
};

// ---- the simulation

/// One robot in one world, stepped in lock-step by the cameras that look at it: a grab hands out the world's present
/// instant if that camera has not had it yet, and otherwise advances the world by one frame period first. So two
/// cameras that are grabbed in turn see one instant. The drive and the truth never advance it. One thread at a time.
///
/// Instant 0, at time 0, is the start; a frame's sequence number is its instant's. Camera::grab fails with kTimeout,
/// and nothing moves, when `run_ahead_frames` instants are still unfinished at its deadline. What opens from a
/// simulation may outlive it; when the last such object goes, pictures still on their way end as kDisconnected.
class Simulation {
 public:
  /// A world inside this program. Reads and checks the scene and looks for POV-Ray. The scene file is not read again
  /// (files that it includes are, for every picture). What only POV-Ray finds wrong in it comes with the first picture:
  /// `FILE:LINE: POV-Ray: ...`
  ///
  /// Errors: kNotFound (no such scene), kUnavailable (no POV-Ray), kRefused (the scene: file, line, column, what was
  /// looked for; or the robot touches something where it begins).
  ///
  /// @throws std::invalid_argument naming every bad field
  static Result<std::unique_ptr<Simulation>> open(const PlaceSettings& place, const SeatSettings& seat);

  /// A place in a world that `serve_world` runs under `name`, on this machine and of this user.
  /// Errors: kNotFound (nobody serves it), kRefused (another version, another user, the robot is taken), kTimeout,
  /// kDisconnected. @throws std::invalid_argument as above
  static Result<std::unique_ptr<Simulation>> attach(const std::string& name, const SeatSettings& seat);

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

/// A world that is entered again and again, by one robot after the other; one thread at a time. What is known of its
/// mirrors, and the POV-Ray processes, stay from one robot to the next; each finds it anew, at time 0, with the very
/// pictures of Simulation::open. Pictures ordered by a robot that has left still come.
class Venue {
 public:
  /// Errors and exceptions: as Simulation::open.
  static Result<Venue> open(const PlaceSettings& place);
  ~Venue();
  Venue(Venue&&) noexcept;
  Venue& operator=(Venue&&) noexcept;

  /// Errors: kRefused: the scene has no such robot; the begin touches something; or the last robot's simulation,
  /// cameras, drive or truth are still there.
  /// @throws std::invalid_argument naming every bad field
  [[nodiscard]] Result<std::unique_ptr<Simulation>> enter(const SeatSettings& seat) const;

 private:
  class Impl;
  explicit Venue(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The walls, solids and moving things of a place in words, a line for each, to a millimetre: what the programs of one
/// world must agree on. At most 4 kB: what is more counts as a sum.
std::string outline_of(const PlaceSettings& place);

/// @throws std::invalid_argument naming every bad field
void check(const PlaceSettings& settings);
void check(const SeatSettings& settings);
void check(const ViewSettings& settings);
void check(const RenderSettings& settings);

/// Where the scene shows a camera standing, over the floor.
struct ShownCamera {
  double x_m = 0, y_m = 0;
  /// Direction of the picture's x axis, in the world; none where that axis is not level, within a degree.
  std::optional<double> x_axis_rad{};
};
/// Of the robot that SeatSettings::name claims; POV-Ray works it out from the camera's statement, without a picture.
/// Gives up when stop is requested.
/// Errors: as Simulation::open; kRefused: why it cannot be worked out (the camera is of another kind, takes its vectors
/// from another camera, its statement holds a directive).
Result<ShownCamera> shown_camera(const PlaceSettings& place, const std::string& robot_name,
                                 const std::string& camera_name, const std::stop_token& stop);

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
/// @param scene_paths as PlaceSettings
/// @throws std::invalid_argument naming every bad argument
Result<Image> render_overhead(const std::filesystem::path& scene, double unit_m, const OverheadView& view,
                              const RenderSettings& render, const std::vector<std::filesystem::path>& scene_paths = {});

}  // namespace twocone::sim_povray

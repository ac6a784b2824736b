// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "apps/config/key_change.h"
#include "apps/config/map_file.h"
#include "drivers/backends.h"
#include "drivers/serial_diffdrive/serial_diffdrive.h"
#include "drivers/sim_povray/session_settings.h"

namespace twocone::config {

/// Standard deviations of the believed wheels; 0: known exactly.
struct WheelSigma {
  double wheel_radius_m = 0;      ///< of both together, >= 0
  double wheel_separation_m = 0;  ///< >= 0
  double wheel_ratio = 0;         ///< of the right wheel's radius over the left one's, >= 0

  friend bool operator==(const WheelSigma&, const WheelSigma&) = default;
};

struct Drive {
  std::string driver;
  double wheel_separation_m = 0;   ///< > 0
  double wheel_radius_m = 0;       ///< > 0
  double max_speed_mps = 0;        ///< of a wheel over the floor, > 0
  double command_timeout_s = 0.5;  ///< dead-man time, 0.001 to 60
  /// Set if and only if the driver is serial_diffdrive.
  std::optional<serial::SerialDriveSettings> serial{};
  std::optional<WheelSigma> sigma{};  ///< none: that of a ruler (ruler_sigma)

  friend bool operator==(const Drive&, const Drive&) = default;
};

/// One mirror and its camera, as the robot believes them to be (`rig:`, from the common keys and from those of `lower:`
/// or `upper:`).
struct RigView {
  double apex_rad = std::numbers::pi / 2;  ///< full angle of the cone, in (0, pi)
  double mirror_radius_m = 0;              ///< R, > 0
  double lens_to_tip_m = 0;                ///< d, > 0
  std::array<double, 2> centre_px{};       ///< column, row of the tip
  double rim_radius_px = 0;                ///< r_m, > 0
  double azimuth_rad = 0;                  ///< bearing of the image's x axis, within one turn either way
  bool mirrored = false;
  std::array<double, 2> tilt_rad{};       ///< of mirror and camera about the body's x and y axes, each within pi/4
  std::array<double, 2> axis_offset_m{};  ///< x and y of the lens in the body's frame
  double late_s = 0;     ///< how much later than its stamp an image's middle row is exposed, -0.5 to 0.5
  double readout_s = 0;  ///< from the exposure of the first row to that of the last row, -0.5 to 0.5
  /// k1 k2 p1 p2 [k3 [k4 k5 k6]] of OpenCV's lens model; empty: no distortion. From the robot file or from
  /// `camera_info`.
  std::vector<double> distortion{};
  /// Focal lengths fx, fy of the distortion model, > 0; none: v, the focal length from the mirror's image.
  std::optional<std::array<double, 2>> distortion_focal_px{};
  /// Column and row of the distortion centre; none: centre_px.
  std::optional<std::array<double, 2>> distortion_principal_px{};
  std::filesystem::path camera_info{};  ///< source of the distortion, resolved; empty: the robot file

  friend bool operator==(const RigView&, const RigView&) = default;
};

/// Standard deviations of the believed rig, each of one number of either view and independent of the others; 0: known
/// exactly. All are >= 0.
struct RigSigma {
  double mirror_radius_m = 0;
  double lens_to_tip_m = 0;
  double mirror_separation_m = 0;
  double lens_height_m = 0;
  double apex_rad = 0;
  double centre_px = 0;  ///< of column and of row
  double rim_radius_px = 0;
  double azimuth_rad = 0;
  double tilt_rad = 0;       ///< about x and about y
  double axis_offset_m = 0;  ///< in x and in y
  double late_s = 0;         ///< of how much later than its stamp either view is exposed
  double readout_s = 0;      ///< of the time from a view's first row to its last
  double distortion = 0;  ///< of k1 and of k2; of a lens without `distortion`, in units of v about the image's middle

  friend bool operator==(const RigSigma&, const RigSigma&) = default;
};

struct Rig {
  RigView lower, upper;
  double mirror_separation_m = 0;   ///< s, > 0
  double lens_height_m = 0;         ///< lower lens above the floor, >= 0
  std::optional<RigSigma> sigma{};  ///< none: that of a ruler (ruler_sigma)
  /// File with the joint covariance of rig, map and wheels (calibration_file.h), in place of `sigma`; resolved; empty:
  /// none.
  std::filesystem::path calibration{};
  /// Keys that the file leaves to the images (apps/estimation/self_rig.h): centre_px, rim_radius_px or azimuth_rad of a
  /// view, as "lower.centre_px". Until they are found, the views hold the image's middle, two fifths of its shorter
  /// side, and 0, and to_rig() refuses the robot.
  std::vector<std::string> missing{};

  friend bool operator==(const Rig&, const Rig&) = default;
};

/// Returns column and row of the middle of a camera's image.
std::array<double, 2> middle_px(const CameraSettings& camera);

/// Returns the standard deviations that count where the file states none: lengths by a ruler to 2 mm, those of the
/// whole robot to 3 mm; half a degree of the cone's angle, 1 degree of tilt, 3 degrees of azimuth; 10 px of the tip and
/// 3 % of the rim's radius, as read off an image by eye; a mild lens.
RigSigma ruler_sigma(const Rig& rig);
/// Likewise 3 % of the wheels' radius, 5 mm between them, 1 % between their radii.
WheelSigma ruler_sigma(const Drive& drive);

/// Deviations of a simulated robot's body from the ideal (`effects:`).
struct Effects {
  double slip = 0;                  ///< standard deviation of each wheel's relative slip, >= 0
  int encoder_counts_per_turn = 0;  ///< 0: exact angles
  double motor_lag_s = 0;           ///< time constant of the wheels' speed, 0 to 60; 0: none
  /// The true sizes of the wheels where they differ from those that the robot believes (`drive:`).
  std::optional<double> wheel_separation_m{};  ///< > 0
  std::optional<double> wheel_radius_m{};      ///< > 0
  /// Any of these three switches the physics on. The others then have the defaults of sim_povray::Physics.
  std::optional<double> mass_kg{};         ///< > 0
  std::optional<double> wheel_friction{};  ///< > 0
  std::optional<double> body_friction{};   ///< >= 0

  friend bool operator==(const Effects&, const Effects&) = default;
};

/// The amount of work for the answer of a frame (`estimator:`). The defaults are the most accurate. Method `paper` has
/// neither stages nor bearings.
struct EstimatorKeys {
  std::string method{};                  ///< `paper` or `outline`; empty: the program's default
  std::string stage = "fine";            ///< of method outline: found, coarse, fine or adaptive
  std::vector<std::string> landmarks{};  ///< names of the landmarks to look for, at least 3; empty: all of the map
  bool bearings = true;                  ///< false: fixes from ranges alone, without heading
  double enough_m = 0.001;               ///< adaptive: refinement stops at this sigma of the position, > 0
  std::optional<double> budget_s{};      ///< adaptive: time for vision and localisation of a frame, > 0; none: no limit
  /// Of method outline: the walls and obstacles of the map, in the scan of each frame, are a second source of the
  /// track.
  bool plan = false;

  friend bool operator==(const EstimatorKeys&, const EstimatorKeys&) = default;
};

/// The parts of a robot and the driver of each part (robots/lab_sim.yaml).
struct Robot {
  std::filesystem::path file;      ///< the path as the caller gave it
  std::vector<KeyChange> changes;  ///< made to the content of the file before it was read
  std::string name;
  std::filesystem::path map;  ///< resolved against the file's folder
  std::string attach;         ///< name of the served world; empty: the program has its own world
  /// Simulation only: the pose in the world at t = 0, at which the scene must show the robot. The heading is within one
  /// turn either way.
  std::optional<Pose2> start;
  int latency_frames = 4;    ///< >= 0
  double body_radius_m = 0;  ///< > 0
  Drive drive;
  /// Images of 1 to 16384 pixels a side at 0.01 to 1000 Hz, one rate for all cameras. The effects of each are those of
  /// `effects.camera`, overridden by its own `effects`.
  drivers::CameraPart lower, upper;
  std::vector<drivers::OtherCamera> others;  ///< in the file's order; names of letters, digits, _
  Rig rig;
  Effects effects;
  EstimatorKeys estimator;
  std::vector<Point> waypoints;  ///< for `--behaviour waypoints`, driven as a closed loop
  double max_skew_s = 0;         ///< between the images of a pair, 0 to 60; default StereoRig::kFreeSkew periods

  friend bool operator==(const Robot&, const Robot&) = default;
};

/// Reads a robot file, changed by `changes`, and the files that it names as `camera_info` (read_camera_info). A message
/// about the value of a changed key names the change instead of the line; one about `name`, or about the start's place
/// on the map, names the key alone. It does not check that the drivers exist (drivers/backends.h), or that the map
/// exists and fits the robot (apps/config/to_layers.h).
/// @throws FileError as read_map
Robot read_robot(const std::filesystem::path& file, const std::vector<KeyChange>& changes = {});
/// Reads a robot from a node of a larger file (run.yaml). Messages name `file`, and relative paths start at its folder.
Robot parse_robot(const YAML::Node& node, const std::filesystem::path& file);
/// Returns the YAML of `robot.file`, changed by `robot.changes`, with the `estimator:` of `robot`, which a run may
/// override, and with absolute paths, for use inside another file (run.yaml). parse_robot reads the same robot from it.
/// @throws FileError as read_robot
YAML::Node load_robot_node(const Robot& robot);

/// Returns the changes of the robot's file after which `cameras.lower` has the entry of `cameras.upper`, and vice
/// versa.
/// @throws FileError as read_robot
std::vector<KeyChange> exchange_cameras(const Robot& robot);

/// Returns the change of the key `rig.sigma` to these numbers.
KeyChange change_to(const RigSigma& sigma);

/// Returns the names of all cameras: lower, upper, then the additional ones.
std::vector<std::string> camera_names(const Robot& robot);

/// Returns the robot with the images of its pair scaled by `k`, > 0. Width and height are rounded to whole pixels. All
/// values in pixels of these images, in `rig:` and in the cameras' effects, are scaled too. A coordinate c becomes
/// (c + 0.5) k - 0.5.
Robot scaled(Robot robot, double k);

/// Returns the text of a robot file that equals `original`, changed by `changed.changes`, except for the values in
/// `changed` of: `map`, `rig:` with its sigmas, the two wheel
/// sizes, width_px, height_px, rate_hz, antialias and effects of the pair, `effects:` of the body, and `estimator:`.
/// Additional cameras take the pair's rate. max_skew_s also follows it if `original` does not set this key.
///
/// The effects of one camera are written into its own `effects`. Only the keys that differ from `original` are written.
/// `effects.camera` stays unchanged, because it also applies to the additional cameras.
///
/// Numbers have enough digits to read back equal. Mirror sizes are written in `rig:` if both mirrors share them, and
/// otherwise in `lower:` and `upper:`. Default values are left out. A view that still has the lens and the image size
/// of its `camera_info` names that file. Any other view has the numbers themselves. `map` and `camera_info` are written
/// relative to the folder of the new file, unless they are absolute in `original`. Comments are lost, and the text
/// states that.
/// @param new_file path for which the text is made; this function writes no file
/// @param header_lines comments at the start, after the licence line
/// @throws FileError as read_robot, for `original`; for numbers that read_robot would reject in the new file; for
/// changed effects of a camera that is not simulated in `original`
std::string robot_text(const std::filesystem::path& original, const std::filesystem::path& new_file,
                       const Robot& changed, const std::vector<std::string>& header_lines);

}  // namespace twocone::config

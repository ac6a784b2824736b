// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/files/map_file.h"
#include "drivers/backends.h"
#include "drivers/serial_diffdrive/serial_diffdrive.h"
#include "drivers/sim_povray/sim_povray.h"

namespace twocone::files {

struct Drive {
  std::string driver;
  double wheel_separation_m = 0;   ///< > 0
  double wheel_radius_m = 0;       ///< > 0
  double max_speed_mps = 0;        ///< of a wheel over the floor, > 0
  double command_timeout_s = 0.5;  ///< dead-man time, 0.001 to 60
  /// serial_diffdrive only, and always there.
  std::optional<serial::SerialDriveSettings> serial{};

  friend bool operator==(const Drive&, const Drive&) = default;
};

struct CameraEntry {
  std::string driver;
  int width_px = 0;    ///< 1 to 16384
  int height_px = 0;   ///< 1 to 16384
  double rate_hz = 0;  ///< 0.01 to 1000, one rate for a pair
  int antialias = 1;   ///< sim_povray only: rays per pixel side, 1 to 9; 1: none
  /// sim_povray only: those of `effects.camera`, where the camera's own `effects` does not say otherwise.
  sim_povray::CameraEffects effects{};
  drivers::CameraDevice device{};  ///< v4l2_camera and libcamera_camera only

  friend bool operator==(const CameraEntry&, const CameraEntry&) = default;
};

/// A camera beyond the pair.
struct NamedCameraEntry {
  std::string name;  ///< letters, digits, _
  CameraEntry camera;

  friend bool operator==(const NamedCameraEntry&, const NamedCameraEntry&) = default;
};

/// One mirror with its camera, as the robot believes them to be (`rig:`, common keys and those of `lower:` or
/// `upper:`).
struct RigView {
  double apex_rad = std::numbers::pi / 2;  ///< full angle of the cone, in (0, pi)
  double mirror_radius_m = 0;              ///< R, > 0
  double lens_to_tip_m = 0;                ///< d, > 0
  std::array<double, 2> centre_px{};       ///< column, row of the tip
  double rim_radius_px = 0;                ///< r_m, > 0
  double azimuth_rad = 0;                  ///< bearing of the image's x axis, a turn either way at most
  bool mirrored = false;
  std::array<double, 2> tilt_rad{};       ///< of mirror and camera about the body's x and y axes, each within pi/4
  std::array<double, 2> axis_offset_m{};  ///< x and y of the lens in the body's frame
  /// k1 k2 p1 p2 [k3 [k4 k5 k6]] of OpenCV's lens model; empty: none. From the file's key or from `camera_info`.
  std::vector<double> distortion{};
  /// fx, fy that the distortion is for, > 0; none: v, that of the mirror's picture.
  std::optional<std::array<double, 2>> distortion_focal_px{};
  /// Column, row that it is about; none: centre_px.
  std::optional<std::array<double, 2>> distortion_principal_px{};
  std::filesystem::path camera_info{};  ///< where distortion was read from, resolved; empty: from the robot file itself

  friend bool operator==(const RigView&, const RigView&) = default;
};

struct Rig {
  RigView lower, upper;
  double mirror_separation_m = 0;  ///< s, > 0
  double lens_height_m = 0;        ///< lower lens above the floor, >= 0

  friend bool operator==(const Rig&, const Rig&) = default;
};

/// Pose in the world at t = 0: in simulation, where the scene shows the robot standing.
struct Start {
  double x_m = 0, y_m = 0;
  double heading_rad = 0;  ///< a turn either way at most

  friend bool operator==(const Start&, const Start&) = default;
};

/// What a simulated robot's body does beyond the ideal (`effects:`).
struct Effects {
  double slip = 0;                  ///< standard deviation of each wheel's relative slip, >= 0
  int encoder_counts_per_turn = 0;  ///< 0: exact angles
  double motor_lag_s = 0;           ///< time constant of the wheels' speed, 0 to 60; 0: none
  /// What the wheels really are, where that is not what the robot believes (`drive:`).
  std::optional<double> wheel_separation_m{};  ///< > 0
  std::optional<double> wheel_radius_m{};      ///< > 0
  /// Any of the three calls for physics; the others are then sim_povray::Physics's.
  std::optional<double> mass_kg{};         ///< > 0
  std::optional<double> wheel_friction{};  ///< > 0
  std::optional<double> body_friction{};   ///< >= 0

  friend bool operator==(const Effects&, const Effects&) = default;
};

/// How much work goes into a frame's answer (`estimator:`); what is not said is the most accurate. Method `paper` knows
/// neither stages nor bearings.
struct EstimatorKeys {
  std::string method{};                  ///< `paper` or `full`; empty: the program's default
  std::string stage = "fine";            ///< of method full: found, coarse, fine or adaptive
  std::vector<std::string> landmarks{};  ///< names of those that are looked for, at least 3; empty: all of the map
  bool bearings = true;                  ///< false: fixes from ranges alone, without heading
  double enough_m = 0.001;               ///< adaptive: position sigma from which on a frame is refined no further, > 0
  std::optional<double> budget_s{};      ///< adaptive: time for vision and localisation of a frame, > 0; none: no limit

  friend bool operator==(const EstimatorKeys&, const EstimatorKeys&) = default;
};

/// What a robot is made of and which driver moves each part (robots/lab_sim.yaml).
struct Robot {
  std::filesystem::path file;  ///< as it was asked for
  std::string name;
  std::filesystem::path map;   ///< resolved against the file's folder
  std::string attach;          ///< name of the served world; empty: a world inside the program
  std::optional<Start> start;  ///< simulation only
  int latency_frames = 4;      ///< >= 0
  double body_radius_m = 0;    ///< > 0
  Drive drive;
  CameraEntry lower, upper;
  std::vector<NamedCameraEntry> others;  ///< further cameras in the file's order, of the pair's rate
  Rig rig;
  Effects effects;
  EstimatorKeys estimator;
  std::vector<Point> waypoints;  ///< for `--behaviour waypoints`, driven as a loop
  double max_skew_s = 0;         ///< of a pair; default StereoRig::kFreeSkew periods, 0 to 60

  friend bool operator==(const Robot&, const Robot&) = default;
};

/// Files of `camera_info` are read too (apps/files/camera_info.h).
/// @throws FileError as read_map. Whether a driver of that name exists is not asked here (drivers/backends.h), nor
/// whether the map exists and the robot fits it (apps/files/to_layers.h).
Robot read_robot(const std::filesystem::path& file);
/// The same from a node of a larger file (run.yaml). `file` is named in messages; relative paths start at its folder.
Robot parse_robot(const YAML::Node& node, const std::filesystem::path& file);
/// The file's YAML with its paths made absolute, to be put into another file (run.yaml) from which parse_robot then
/// reads the same robot. @throws FileError as read_robot
YAML::Node load_robot_node(const std::filesystem::path& file);
/// The same of `robot.file`, but with the `estimator:` of `robot`, which a run may have been told otherwise.
YAML::Node load_robot_node(const Robot& robot);

}  // namespace twocone::files

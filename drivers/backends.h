// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/serial_diffdrive/serial_diffdrive.h"
#include "drivers/sim_povray/sim_povray.h"
#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/result.h"
#include "hal/robot.h"

/// The one place that names every driver, and opens a robot from its parsed settings.
namespace twocone::drivers {

/// The drivers' names, as after `driver:` in a robot file.
inline constexpr std::string_view kMemory = "memory";
inline constexpr std::string_view kSimPovray = "sim_povray";
inline constexpr std::string_view kV4l2Camera = "v4l2_camera";
inline constexpr std::string_view kLibcameraCamera = "libcamera_camera";
inline constexpr std::string_view kSerialDiffDrive = "serial_diffdrive";

/// One row of the table of drivers: also those that are known but not in this build, so that a robot file which asks
/// for one is told what is missing.
struct Backend {
  std::string_view name;  ///< as after `driver:` in a robot file
  bool for_cameras = false;
  bool for_drive = false;
  std::string_view why_not;  ///< why this build has it not; empty if it has

  [[nodiscard]] bool available() const { return why_not.empty(); }
};

/// Every driver, in the order in which messages and `devices` list them.
std::span<const Backend> backends();

/// A real camera.
struct CameraDevice {
  std::string name;                                        ///< which one, as its driver names cameras
  std::string format;                                      ///< as V4L2 names formats; empty: the driver chooses
  std::vector<std::pair<std::string, double>> controls{};  ///< by the driver's names, in order

  friend bool operator==(const CameraDevice&, const CameraDevice&) = default;
};

struct CameraPart {
  std::string driver;
  CameraSettings settings;              ///< what Robot::start is to ask for
  int antialias = 1;                    ///< sim_povray only: sim_povray::ViewSettings::antialias, 1 to 9
  sim_povray::CameraEffects effects{};  ///< sim_povray only
  CameraDevice device{};                ///< v4l2_camera and libcamera_camera only
};

/// A camera beyond the pair.
struct OtherCamera {
  std::string name;  ///< as after `cameras:` in the robot file; for sim_povray, what the scene calls it
  CameraPart part;
};

/// The world of a simulated robot: one inside this program, or one that another program serves.
struct SimulatedWorld {
  std::string attach;               ///< name of the served world; empty: `place`, inside this program
  sim_povray::PlaceSettings place;  ///< unused when attached
  sim_povray::SeatSettings seat;    ///< its `drive` is replaced by RobotSettings::drive.limits
};

struct DrivePart {
  std::string driver;
  DriveLimits limits;
  std::optional<serial::SerialDriveSettings> serial{};  ///< needed by serial_diffdrive
};

/// What a robot is made of. The parts' names in messages are those of the robot file: cameras.lower, cameras.upper,
/// drive.
struct RobotSettings {
  CameraPart lower;  ///< for sim_povray, the camera that the scene calls `lower`
  CameraPart upper;
  DrivePart drive;
  /// Pairs whose exposures are farther apart are refused, >= 0. Memory and sim_povray show one instant: 0 suits them.
  std::chrono::nanoseconds max_skew{0};
  std::vector<OtherCamera> others;      ///< at the rate of the pair
  std::optional<SimulatedWorld> world;  ///< needed by sim_povray, unused by others
};

/// A device of this machine that a robot file could name.
struct Device {
  std::string driver;
  std::string name;  ///< for the robot file: a name that stays the same after the next plugging in, if it has one
  std::string what;  ///< maker, model, where it is now
  std::vector<std::string> details;  ///< formats and sizes of a camera
};
struct Devices {
  std::vector<Device> found;
  /// Kinds of devices that could not be looked for, each with why.
  std::vector<std::string> not_looked_for;
};
/// Cameras and serial ports, in the order of backends(). Opens cameras for a moment, ports not.
Devices list_devices();

/// One part of a robot by itself, for whoever tests it; one of a simulation has no meaning without the others.
/// Errors: as open_robot's; kRefused for sim_povray. @throws std::invalid_argument naming every bad field
Result<std::unique_ptr<Camera>> open_camera(const std::string& part, const CameraPart& camera);
Result<std::unique_ptr<DiffDrive>> open_drive(const DrivePart& drive);

/// Two of the robot's cameras that are one, though the robot file may name it in two ways; nothing: each has its own.
/// Looks at this machine's devices. Error: kRefused, naming both entries.
Status check_cameras_differ(const RobotSettings& settings);

/// @throws std::invalid_argument naming every bad field by its part; among them a pair of cameras with two rates, and
/// sim_povray without a world.
void check(const RobotSettings& settings);

/// Opens every part and puts them together; the caller starts it with `lower.settings` and `upper.settings`.
///
/// `memory`: all three parts share one simulated clock that the cameras' grabs advance by a frame period (lock-step):
/// such a robot runs at once and without devices, and has no ground truth. `sim_povray`: one Simulation, with truth.
/// Either moves all parts of a robot or none.
///
/// Errors: kNotFound (no such driver), kUnavailable (known, not in this build), kRefused (a driver for another kind of
/// part; parts that cannot go together; one camera for two entries), and those of Simulation::open and open_camera.
/// @throws std::invalid_argument as check() does.
Result<Robot> open_robot(const RobotSettings& settings);

}  // namespace twocone::drivers

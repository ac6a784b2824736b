// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/serial_diffdrive/serial_diffdrive.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/session_settings.h"
#include "hal/camera.h"
#include "hal/device_info.h"
#include "hal/diff_drive.h"
#include "hal/result.h"
#include "hal/robot.h"

/// The only place that names every driver. It opens a robot from its parsed settings.
namespace twocone::drivers {

/// The names, as after `driver:` in a robot file, of the drivers that are treated differently from others.
inline constexpr std::string_view kMemory = "memory";
inline constexpr std::string_view kSimPovray = "sim_povray";
inline constexpr std::string_view kSerialDiffDrive = "serial_diffdrive";

/// One row of the table of drivers. The table also lists known drivers that are not in this build, so that a message
/// about a robot file that names one can report what is missing.
struct Backend {
  /// The settings that a robot file may have for a part of this driver, in addition to those of all parts.
  enum class Keys {
    kNone,
    kCamera,              ///< device, format, controls: CameraDevice
    kCameraWithIntegers,  ///< the same; the values of its controls are whole numbers
    kSerialDrive,         ///< protocol, port, baud, ...: serial::SerialDriveSettings
  };
  std::string_view name;  ///< as after `driver:` in a robot file
  bool for_cameras = false;
  bool for_drive = false;
  std::string_view why_not;  ///< why the driver is not in this build; empty: it is
  Keys keys = Keys::kNone;

  [[nodiscard]] bool available() const { return why_not.empty(); }
  [[nodiscard]] bool has_device() const { return keys != Keys::kNone; }
};

/// Returns every driver, in the order in which messages and `devices` list them.
std::vector<Backend> backends();
/// Returns the driver of that name; null: there is none.
const Backend* find_backend(std::string_view name);

struct CameraPart {
  std::string driver;
  CameraSettings settings;              ///< requested by Robot::start
  int antialias = 1;                    ///< sim_povray only: sim_povray::ViewSettings::antialias, 1 to 9
  sim_povray::CameraEffects effects{};  ///< sim_povray only
  CameraDevice device{};                ///< v4l2_camera and libcamera_camera only

  friend bool operator==(const CameraPart&, const CameraPart&) = default;
};

/// A camera beyond the pair.
struct OtherCamera {
  std::string name;  ///< as after `cameras:` in the robot file; for sim_povray, also its name in the scene
  CameraPart part;

  friend bool operator==(const OtherCamera&, const OtherCamera&) = default;
};

/// The world of a simulated robot: either inside this program, or served by another program.
struct SimulatedWorld {
  std::string attach;                   ///< name of the served world; empty: `place` is opened inside this program
  sim_povray::PlaceSettings place;      ///< unused when attached
  sim_povray::SessionSettings session;  ///< its `drive` is replaced by RobotSettings::drive.limits
};

struct DrivePart {
  std::string driver;
  DriveLimits limits;
  std::optional<serial::SerialDriveSettings> serial{};  ///< needed by serial_diffdrive
};

/// The parts of a robot. Messages name them as the robot file does: cameras.lower, cameras.upper, drive.
struct RobotSettings {
  CameraPart lower;  ///< for sim_povray, the camera that is named `lower` in the scene
  CameraPart upper;
  DrivePart drive;
  /// Pairs whose exposures are farther apart are refused, >= 0. Both cameras of memory and of sim_povray show the same
  /// moment, so 0 suits them.
  std::chrono::nanoseconds max_skew{0};
  std::vector<OtherCamera> others;      ///< at the rate of the pair
  std::optional<SimulatedWorld> world;  ///< needed by sim_povray, unused by others
};

/// The result of list_devices().
struct Devices {
  std::vector<DeviceInfo> found;
  /// Kinds of devices that could not be searched for, each with the reason.
  std::vector<std::string> not_looked_for;
};
/// Lists cameras and serial ports, in the order of backends(). It opens each camera briefly, but no port.
Devices list_devices();

/// Opens one part of a robot alone, for tests of that part. A part of a simulation has no meaning without the others.
/// Errors: those of open_robot; kRefused for sim_povray. @throws std::invalid_argument naming every bad field
Result<std::unique_ptr<Camera>> open_camera(const std::string& part, const CameraPart& camera);
Result<std::unique_ptr<DiffDrive>> open_drive(const DrivePart& drive);

/// Checks that no two entries of the robot are the same camera, which the robot file may name in two ways. It examines
/// this machine's devices. Error: kRefused, naming both entries.
Status check_cameras_differ(const RobotSettings& settings);

/// @throws std::invalid_argument naming every bad field by its part; also if the two cameras of the pair have different
/// rates, or if sim_povray has no world.
void check(const RobotSettings& settings);

/// Opens every part and assembles the robot. The caller starts it with `lower.settings` and `upper.settings`.
///
/// `memory`: all three parts share one simulated clock, which the cameras' grabs advance by a frame period (lock-step).
/// Such a robot runs without devices and without waiting, and has no ground truth. `sim_povray`: all parts belong to
/// one Simulation, with ground truth. Either all parts of a robot have this driver or none has.
///
/// Errors: kNotFound (no such driver), kUnavailable (known, not in this build), kRefused (a driver for another kind of
/// part; parts that cannot be combined; one camera for two entries), and those of Simulation::open and attach, and of
/// the drivers' own open_camera() and open_drive().
/// @throws std::invalid_argument as check() does.
Result<Robot> open_robot(const RobotSettings& settings);

}  // namespace twocone::drivers

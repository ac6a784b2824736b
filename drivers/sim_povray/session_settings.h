// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/plane.h"
#include "drivers/sim_povray/pixel_truth.h"
#include "hal/diff_drive.h"
#include "hal/image.h"

namespace twocone::sim_povray {

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
  double mass_kg = 5.0;         ///< > 0; the moment of inertia is that of a uniform disc of the body's radius
  double wheel_friction = 0.8;  ///< Coulomb's between wheel and floor, > 0; each wheel carries half the weight
  double body_friction = 0.3;   ///< between the body and the objects that it touches, >= 0
};

/// The part of a robot that the world moves.
struct RobotBody {
  std::string name = "robot";  ///< name in the messages of other robots
  Pose2 start{};               ///< pose at which the scene shows the robot; the heading is wrapped to (-pi, pi]
  double radius_m = 0;         ///< radius of the disc for contacts, >= 0; 0: it touches nothing
  WheelSettings wheels{};
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
  std::string name{};
  RobotBody body{};  ///< the claimed object's name replaces its name
  DriveLimits drive{};
  /// Outline of the place according to the robot's map, as outline_of() writes it. A world with a different outline
  /// refuses the robot. Empty: unknown.
  std::string map_outline{};
  int run_ahead_frames = 6;  ///< steps whose images may be unfinished before a grab waits, >= 1
  /// Called from any thread after each image is rendered (several times for an image that is averaged from shutter
  /// samples), before the frame is ready. The function must neither block nor throw, and may be called after the robot
  /// has left. It is not called for the renderings that locate a mirror, for images of a world that another program
  /// serves, or where the system does not report the use.
  std::function<void(const RenderedImage&)> rendered{};
  /// Returns the finished image that a camera (by ViewSettings::camera_name) took at a step of an equal world before.
  /// The camera then returns this image and renders none. Null: there is no such image. Called by grab().
  std::function<std::shared_ptr<const Image>(const std::string& camera, std::uint64_t step)> stored{};
  /// Called from any thread with what the pixels of each rendered image show, before its frame is ready. The function
  /// must neither block nor throw. It is that of the rendered light: camera effects do not change it, and of the
  /// shutter samples the middle one counts (number n / 2 of n, from 0). A world that POV-Ray renders then refuses the
  /// robot or its first image (kRefused), and one that another program serves never calls the function. Empty: costs
  /// nothing.
  std::function<void(const std::string& camera, std::uint64_t step, PixelTruth)> truth{};
};

/// Length of the history of poses that a world stores, in addition to its last step.
constexpr double kMaxStampLate_s = 0.5;

/// Lamps on mains of 50 Hz light up with each half wave.
constexpr double kLampFlicker_hz = 100;

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
  /// Colour of the lamps: factors on linear red, green and blue, each > 0; empty: white.
  std::vector<double> colour_gain{};
  /// The lamps' light is 1 + flicker cos(2 pi kLampFlicker_hz t + phase) of its mean, 0 to 1. What a pixel sees of it
  /// is the mean over its row's exposure.
  double flicker = 0;
  int jpeg_quality = 0;  ///< of libjpeg, 1 to 100: the image is compressed and decompressed; 0: it is not

  friend bool operator==(const CameraEffects&, const CameraEffects&) = default;
};

/// Settings of a camera of the scene in addition to CameraSettings.
struct ViewSettings {
  std::string camera_name{};  ///< `lower`, `upper`: its `//*PMName`, without the robot's name
  /// Rays per pixel side, 1 to 9, on a regular grid, wherever a pixel differs from its neighbours by more than 0.03
  /// (POV-Ray's +AM1 +A0.03 +R). 1: one ray through the pixel's centre, no anti-aliasing. Cost at 640 x 480: 0.3 s for
  /// 1, 1 s for 3.
  int antialias = 1;
  CameraEffects effects{};
};

/// @throws std::invalid_argument naming every bad field
void check(const SessionSettings& settings);
void check(const ViewSettings& settings);

}  // namespace twocone::sim_povray

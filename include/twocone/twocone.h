// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "twocone/types.h"

/// A robot from its robot file, simulated or real, and where it is. Link twocone::twocone.
///
///     auto robot = twocone::open_robot("robots/lab_sim.yaml");
///     twocone::Localiser localiser(robot->description());
///     while (true) {
///       const auto frame = robot->next_frame(std::chrono::seconds(1));
///       const auto answer = localiser.update(*frame);           // ranges, fix and track
///       robot->set_velocity({.forward_mps = 0.2, .turn_radps = 0.1});
///     }
///
/// Nothing here asks whether the robot is simulated. A simulated world advances by one frame period with each call of
/// next_frame() and stands still otherwise. One thread at a time.
namespace twocone {
inline namespace v0_1 {

class ConnectedRobot;
struct OpenOptions;
Expected<ConnectedRobot> open_robot(const std::filesystem::path& robot_file, const OpenOptions& options);

/// Robot file and map, as read and checked.
class RobotDescription {
 public:
  /// Also reads the map that the robot file names. @throws std::runtime_error naming file, line, key and what would be
  /// right
  explicit RobotDescription(const std::filesystem::path& robot_file);

  struct Landmark {
    std::string name;
    double x_m = 0, y_m = 0;  ///< of its axis, world frame
    double radius_m = 0, top_m = 0;
  };
  [[nodiscard]] std::vector<Landmark> landmarks() const;
  /// The robot file's `waypoints_m`.
  [[nodiscard]] std::vector<Pose> waypoints() const;
  [[nodiscard]] Pose start() const;

 private:
  friend class ConnectedRobot;
  friend class Localiser;
  friend Expected<ConnectedRobot> open_robot(const std::filesystem::path&, const OpenOptions&);
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// One image of a frame: rows from the top, three bytes (red, green, blue) a pixel.
struct ImageView {
  int width_px = 0, height_px = 0;
  std::span<const std::uint8_t> rgb;  ///< valid as long as the frame
};

/// Both images of one moment, with what the wheels had turned by then. Cheap to copy.
class CapturedFrame {
 public:
  [[nodiscard]] std::uint64_t number() const;  ///< counts calls of next_frame(), from 0
  [[nodiscard]] double t_s() const;            ///< when it was taken, from the first frame on
  /// Wait for the pixels, which a simulation renders in the background. Failures: kTimeout, kDisconnected, kBadData,
  /// kRefused (the scene: file, line and reason)
  [[nodiscard]] Expected<ImageView> lower() const;
  [[nodiscard]] Expected<ImageView> upper() const;

 private:
  friend class ConnectedRobot;
  friend class Localiser;
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// Speeds of the body.
struct Velocity {
  double forward_mps = 0;
  double turn_radps = 0;  ///< counter-clockwise
};

struct OpenOptions {
  std::uint64_t seed = 1;  ///< of everything random in a simulation
  /// SIGINT and SIGTERM end the present call with kCancelled instead of ending the program.
  bool stop_on_signals = false;
};

/// An opened robot. Its destructor stops the wheels first, then the cameras. However the program ends, the wheels stop
/// within the robot file's command_timeout_s.
class ConnectedRobot {
 public:
  ConnectedRobot(ConnectedRobot&&) noexcept;
  ConnectedRobot& operator=(ConnectedRobot&&) noexcept;
  ~ConnectedRobot();

  [[nodiscard]] const RobotDescription& description() const;

  /// The next pair of images. Failures: kTimeout, kDisconnected, kBadData, kCancelled. After a failure the wheels are
  /// stopped, and the call may be repeated: a device that comes back is opened again.
  Expected<CapturedFrame> next_frame(std::chrono::milliseconds timeout);

  /// Commands both wheels; what exceeds the drive's limit is reduced, and what is applied comes back. To be repeated
  /// within command_timeout_s, or the wheels stop. Failures: kDisconnected, kTimeout, kBadData
  Expected<Velocity> set_velocity(const Velocity& velocity);

  /// Where the robot really was at the newest frame: simulation only, for records and tests.
  [[nodiscard]] std::optional<Pose> true_pose() const;

  /// Stops the wheels, then the cameras.
  void stop() noexcept;

 private:
  friend Expected<ConnectedRobot> open_robot(const std::filesystem::path&, const OpenOptions&);
  struct Impl;
  explicit ConnectedRobot(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Opens and starts what the robot file describes. Failures: kNotFound, kUnavailable, kRefused, kDisconnected.
/// @throws std::runtime_error for a wrong file, naming file, line, key and what would be right
Expected<ConnectedRobot> open_robot(const std::filesystem::path& robot_file, const OpenOptions& options);
/// The same with the default options.
Expected<ConnectedRobot> open_robot(const std::filesystem::path& robot_file);

/// Why a range is given or withheld (docs/verdicts.md).
enum class RangeVerdict {
  kOk,
  kNotSeen,
  kTruncated,
  kNoMatch,
  kBeyondLimit,
  kSameColour,
  kOneView,
  kOccluded,
  kSaturated,
  kTwoCandidates,
  kInconsistent,
  kImpossible,
};

/// What one frame shows of one landmark. Fields without an answer are empty.
struct RangeAnswer {
  std::string landmark;
  RangeVerdict verdict = RangeVerdict::kNotSeen;
  std::optional<double> range_m, sigma_range_m;          ///< horizontal, to the landmark's axis
  std::optional<double> bearing_rad, sigma_bearing_rad;  ///< in the body frame, (-pi, pi]
};

/// What one frame says about the robot's surroundings and place.
struct FrameReport {
  std::vector<RangeAnswer> ranges;           ///< one a landmark, in the map's order
  PoseAnswer fix;                            ///< from this frame alone
  std::optional<Pose> track;                 ///< fixes and wheels together, once there was a fix
  std::optional<PoseCovariance> covariance;  ///< of the track
  Pose odometry;                             ///< the wheels alone, from the robot file's start on
};

/// Ranges, fix and track as the robot file's `estimator:` asks for.
class Localiser {
 public:
  /// @throws std::runtime_error for a rig or a map that the method cannot use
  explicit Localiser(const RobotDescription& description);
  Localiser(Localiser&&) noexcept;
  Localiser& operator=(Localiser&&) noexcept;
  ~Localiser();

  /// Waits for the frame's images. Frames come in order. Failures: those of CapturedFrame::lower()
  Expected<FrameReport> update(const CapturedFrame& frame);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

[[nodiscard]] const char* to_string(FixVerdict verdict);
[[nodiscard]] const char* to_string(RangeVerdict verdict);
[[nodiscard]] const char* to_string(FailureCode code);

}  // namespace v0_1
}  // namespace twocone

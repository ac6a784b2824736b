// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "twocone/types.h"

/// Opens a robot, simulated or real, from its robot file, and localises it. Link twocone::twocone.
///
///     auto robot = twocone::open_robot("robots/lab_sim.yaml");
///     twocone::Localiser localiser(robot->description());
///     while (true) {
///       const auto frame = robot->next_frame(std::chrono::seconds(1));
///       const auto answer = localiser.update(*frame);           // ranges, fix and track
///       robot->set_velocity({.forward_mps = 0.2, .turn_radps = 0.1});
///     }
///
/// No call depends on whether the robot is simulated. A simulated world advances by one frame period with each call of
/// next_frame() and is stopped otherwise. A robot must be used by one thread at a time.
namespace twocone {
inline namespace v1_0 {

class ConnectedRobot;
struct OpenOptions;
Expected<ConnectedRobot> open_robot(const std::filesystem::path& robot_file, const OpenOptions& options);

/// The content of a robot file and its map, read and checked.
class RobotDescription {
 public:
  /// Reads the robot file and the map that it names. @throws std::runtime_error naming file, line, key and the valid
  /// values
  explicit RobotDescription(const std::filesystem::path& robot_file);

  struct Landmark {
    std::string name;
    double x_m = 0, y_m = 0;  ///< of the axis, world frame
    double radius_m = 0, top_m = 0;
  };
  [[nodiscard]] std::vector<Landmark> landmarks() const;
  /// Returns the robot file's `waypoints_m`; their headings are 0.
  [[nodiscard]] std::vector<Pose> waypoints() const;
  [[nodiscard]] Pose start() const;

 private:
  friend class ConnectedRobot;
  friend class Localiser;
  friend Expected<ConnectedRobot> open_robot(const std::filesystem::path&, const OpenOptions&);
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// One image of a frame: rows from the top, three bytes (red, green, blue) per pixel.
struct ImageView {
  int width_px = 0, height_px = 0;
  std::span<const std::uint8_t> rgb;  ///< valid as long as a copy of the frame exists
};

/// Both images of one moment, and the angles that the wheels had turned by then. A copy is cheap.
class CapturedFrame {
 public:
  [[nodiscard]] std::uint64_t number() const;  ///< counts calls of next_frame(), from 0
  [[nodiscard]] double t_s() const;            ///< time of the lower image since that of the first frame
  /// Waits for the pixels, which a simulation renders in the background, and returns them. Failures: kTimeout,
  /// kDisconnected, kBadData, kUnavailable, kCancelled, kRefused (an error in the scene: file, line and reason).
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
  std::uint64_t seed = 1;  ///< seed of all random processes of a simulation
  /// SIGINT and SIGTERM do not end the program: next_frame() and waits for pixels then return kCancelled.
  bool stop_on_signals = false;
  /// Is asked about every 100 ms while a call waits, on the thread that waits. If it returns true, next_frame() and
  /// waits for pixels return kCancelled. May be empty.
  std::function<bool()> is_cancelled{};
};

/// An opened robot. Its destructor stops the wheels first, then the cameras. If the program ends in any other way, the
/// wheels stop within the robot file's command_timeout_s.
class ConnectedRobot {
 public:
  ConnectedRobot(ConnectedRobot&&) noexcept;
  ConnectedRobot& operator=(ConnectedRobot&&) noexcept;
  ~ConnectedRobot();

  [[nodiscard]] const RobotDescription& description() const;

  /// Returns the next pair of images. Failures: kTimeout, kDisconnected, kBadData, kUnavailable, kRefused, kCancelled,
  /// kInvalidState (after stop()). A failure stops the wheels. The call may be repeated: a device that comes back is
  /// reopened.
  Expected<CapturedFrame> next_frame(std::chrono::milliseconds timeout);

  /// Commands both wheels and returns the applied velocity, which the drive's limit may reduce. The wheels stop unless
  /// the call is repeated within command_timeout_s. Failures: kDisconnected, kTimeout, kBadData, kRefused,
  /// kUnavailable.
  Expected<Velocity> set_velocity(const Velocity& velocity);

  /// Returns the robot's true pose at the newest frame, for records and tests; empty on hardware.
  [[nodiscard]] std::optional<Pose> true_pose() const;

  /// Returns what the robot's body touches at the newest frame, by its name: "wall", "landmark red". Empty: nothing,
  /// and on hardware.
  [[nodiscard]] std::string contact() const;

  /// Stops the wheels, then the cameras.
  void stop() noexcept;

 private:
  friend Expected<ConnectedRobot> open_robot(const std::filesystem::path&, const OpenOptions&);
  struct Impl;
  explicit ConnectedRobot(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Opens the robot that the robot file describes, and starts its cameras. Failures: kNotFound, kUnavailable, kRefused,
/// kDisconnected, kTimeout, kBadData.
/// @throws std::runtime_error for a wrong file, naming file, line, key and the valid values
Expected<ConnectedRobot> open_robot(const std::filesystem::path& robot_file, const OpenOptions& options);
/// Opens the robot with the default options.
Expected<ConnectedRobot> open_robot(const std::filesystem::path& robot_file);

/// The reason why a range is given or withheld (docs/verdicts.md).
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

/// The measurement of one landmark from one frame. Fields without an answer are empty.
struct RangeAnswer {
  std::string landmark;
  RangeVerdict verdict = RangeVerdict::kNotSeen;
  std::optional<double> range_m, sigma_range_m;          ///< horizontal, to the landmark's axis
  std::optional<double> bearing_rad, sigma_bearing_rad;  ///< in the body frame, (-pi, pi]
};

/// The answer of a Localiser to one frame.
struct FrameReport {
  std::vector<RangeAnswer> ranges;           ///< one per landmark, in the map's order
  PoseAnswer fix;                            ///< from this frame alone
  std::optional<Pose> track;                 ///< from fixes and wheels; empty before the first fix
  std::optional<PoseCovariance> covariance;  ///< of the track
  Pose odometry;                             ///< from the wheels alone, since the robot file's start
};

/// The total angles that both wheels have turned, forwards positive.
struct WheelTurns {
  double left_rad = 0, right_rad = 0;
};

/// A pair of images of one moment that another program has taken.
struct OwnFrame {
  ImageView lower, upper;            ///< of the sizes that the robot file states
  double t_s = 0;                    ///< of the lower image, later than that of the frame before
  std::optional<WheelTurns> wheels;  ///< at t_s; all frames of a localiser have them, or none
};

/// Computes ranges, fix and track as the robot file's `estimator:` specifies.
class Localiser {
 public:
  /// @throws std::runtime_error for a rig or a map that the method cannot use
  explicit Localiser(const RobotDescription& description);
  Localiser(Localiser&&) noexcept;
  Localiser& operator=(Localiser&&) noexcept;
  ~Localiser();

  /// Waits for the frame's images and answers it. Frames must be in order. Failures: those of CapturedFrame::lower().
  Expected<FrameReport> update(const CapturedFrame& frame);
  /// Answers a frame of one's own. Without wheels, the track is the frame's own fix. Failures: kBadData for images of
  /// other sizes, for pixels that are not as many as an image's size states, and for numbers that are not finite;
  /// kInvalidState for a time that is not later than the frame's before, and for wheels that come or go.
  Expected<FrameReport> update(const OwnFrame& frame);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

[[nodiscard]] const char* to_string(FixVerdict verdict);
[[nodiscard]] const char* to_string(RangeVerdict verdict);
[[nodiscard]] const char* to_string(FailureCode code);

}  // namespace v1_0
}  // namespace twocone

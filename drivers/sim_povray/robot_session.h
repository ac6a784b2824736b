// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <future>
#include <string>

#include "base/plane.h"
#include "drivers/sim_povray/session_settings.h"
#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/image.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// State of the world at one step, as reported to a robot.
struct SessionState {
  std::uint64_t step = 0;           ///< number of the step, from 0
  std::chrono::nanoseconds now{0};  ///< simulated time of the step, at which its exposure ends
  Pose2 pose;                       ///< of the robot, in the middle of its first camera's exposure
  double left_rad = 0;              ///< angles that the wheels have turned since the robot joined
  double right_rad = 0;
  std::string contact;  ///< name of the touched object: "wall", "landmark red", "robot.2"; empty: nothing
};

/// One robot's connection to a world, which its cameras, its drive and its truth use. The world may be in this program
/// or, over a link, in another one; both behave alike. A session must be used by one thread at a time.
///
/// The destructor leaves the world: the wheels stop, the robot stays where it is, and the world no longer waits for it.
class RobotSession {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;
  /// A view of this session, counted from 0 in the order of open_view().
  using ViewId = std::uint32_t;

  virtual ~RobotSession() = default;
  RobotSession(const RobotSession&) = delete;
  RobotSession& operator=(const RobotSession&) = delete;

  /// Returns the state at the session's last step; before the first step, at the time of joining.
  [[nodiscard]] virtual const SessionState& state() const = 0;

  /// Opens a camera that is mounted on the robot, by its ViewSettings::camera_name. Errors: kRefused (no such camera,
  /// or two), kDisconnected.
  virtual Result<ViewId> open_view(const ViewSettings& view) = 0;
  /// Sets the size of the view's images from now on, and starts the preparation for the first one. Does not wait.
  /// Errors: kRefused (the world runs at another rate), kUnavailable (no thread is available), kDisconnected.
  virtual Status configure_view(ViewId view, const CameraSettings& settings) = 0;
  /// Releases the view's claim to a rate.
  virtual void release_view(ViewId view) noexcept = 0;

  /// Advances to the next step: the world steps once every robot in it has requested that. Errors: kTimeout (a robot
  /// has not requested it, or too many images are unfinished; nothing has moved, and the message names the robots or
  /// the number of steps), kInvalidState (no view of the world has been configured), kDisconnected.
  virtual Status step(SteadyTime deadline) = 0;
  /// Orders the view's image of the present step.
  virtual std::shared_future<ImageResult> image(ViewId view) = 0;

  /// Sets the wheels' speeds from the present step on. Errors: kDisconnected.
  virtual Status command(const WheelSpeeds& speeds) = 0;
  virtual Status halt() noexcept = 0;

  /// Returns whether another robot has requested the next step, and this one has not.
  [[nodiscard]] virtual bool is_waited_for() const { return false; }

 protected:
  RobotSession() = default;
};

}  // namespace twocone::sim_povray

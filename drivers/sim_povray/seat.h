// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <future>
#include <string>

#include "drivers/sim_povray/sim_povray.h"
#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/frame.h"
#include "hal/pose.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// What a robot may be told of its world at one instant.
struct SeatState {
  std::uint64_t tick = 0;           ///< number of the instant, from 0
  std::chrono::nanoseconds now{0};  ///< simulated time of the instant, which is the end of its exposures
  Pose2 pose;                       ///< of the robot, now
  double left_rad = 0;              ///< how far its wheels have turned since it took its seat
  double right_rad = 0;
  std::string contact;  ///< what the body touches: "wall", "landmark red", "robot.2"; empty: nothing
};

/// One robot's place in a world: all that its cameras, its drive and its truth ask for. The world may be in this
/// program or, over a link, in another; nothing tells the two apart. One thread at a time.
///
/// The destructor leaves the world: the wheels stop, the robot stays where it is, and the world no longer waits for it.
class Seat {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;
  /// A view of this seat, counted from 0 in the order of open_view().
  using ViewId = std::uint32_t;

  virtual ~Seat() = default;
  Seat(const Seat&) = delete;
  Seat& operator=(const Seat&) = delete;

  /// As of the seat's last step; before that, of its taking.
  [[nodiscard]] virtual const SeatState& state() const = 0;

  /// A camera that rides on the robot, by its ViewSettings::camera_name. Errors: kRefused (no such camera, or two),
  /// kDisconnected.
  virtual Result<ViewId> open_view(const ViewSettings& view) = 0;
  /// The view's pictures are of this size from now on; begins what has to be known before the first one. Does not
  /// wait. Errors: kRefused (the world runs at another rate), kDisconnected.
  virtual Status configure_view(ViewId view, const CameraSettings& settings) = 0;
  /// The view's wish for a rate no longer counts.
  virtual void release_view(ViewId view) noexcept = 0;

  /// To the next instant: the world steps once every robot in it has asked. Errors: kTimeout (somebody has not asked,
  /// or too many pictures are unfinished: the message says who or how many; nothing has moved), kInvalidState (no view
  /// of the world has been configured), kDisconnected.
  virtual Status step(SteadyTime deadline) = 0;
  /// Orders the view's picture of the present instant.
  virtual std::shared_future<ImageResult> picture(ViewId view) = 0;

  /// The wheels' speeds from the present instant on. Errors: kDisconnected.
  virtual Status command(const WheelSpeeds& speeds) = 0;
  virtual Status halt() noexcept = 0;

  /// Whether somebody has asked for the next instant, and this robot has not.
  [[nodiscard]] virtual bool is_waited_for() const { return false; }

 protected:
  Seat() = default;
};

}  // namespace twocone::sim_povray

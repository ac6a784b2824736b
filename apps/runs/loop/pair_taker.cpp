// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/pair_taker.h"

#include <utility>

#include "apps/runs/devices.h"

namespace twocone::runs {

Result<TakenPair> PairTaker::take(Robot& robot, StereoFrame frame) {
  const auto arrived = std::chrono::steady_clock::now();
  const auto reading = robot.drive().read_angles();
  if (!reading) return with_name("drive", reading.error());
  if (!robot.pace().waits_for_program) {
    if (auto decoded = decode(frame); !decoded) return decoded.error();
  }
  wheels_.add(*reading);
  const Timestamp captured = frame.lower.header().captured;
  const WheelAngles angles = wheels_.at(captured);
  if (!zero_s_) zero_s_ = captured.seconds();
  const double t_s = captured.seconds() - *zero_s_;
  const double upper_t_s = frame.upper.header().captured.seconds() - *zero_s_;
  return TakenPair{std::move(frame), arrived, t_s,
                   upper_t_s,        angles,  odometry_.update(angles.left_rad, angles.right_rad)};
}

}  // namespace twocone::runs

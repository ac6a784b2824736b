// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>

#include <Eigen/Core>

#include "localisation/odometry.h"

namespace twocone::runs {

/// What a robot steers by: odometry, its position corrected by fixes that arrive some frames late (DESIGN.md,
/// `latency_frames`).
///
/// A fix tells where the robot was at its frame, so it corrects by its difference from the odometry of that frame. Only
/// a share of the difference is taken at a time: steering wants a calm pose, and one wild fix must not throw it. The
/// heading is the odometry's.
class BelievedPose {
 public:
  /// Of each correction: the noise of the fixes is averaged over about 1 / kShare of them.
  static constexpr double kShare = 0.2;

  void add_odometry(std::uint64_t frame, const localisation::Pose& pose);
  /// @param frame one that add_odometry was given and that no later fix has passed
  void add_fix(std::uint64_t frame, const Eigen::Vector2d& position_m);

  /// The newest odometry, corrected.
  [[nodiscard]] localisation::Pose pose() const;

 private:
  struct Entry {
    std::uint64_t frame;
    localisation::Pose pose;
  };
  std::deque<Entry> odometry_;  ///< from the last fix's frame on
  Eigen::Vector2d correction_m_ = Eigen::Vector2d::Zero();
};

}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>

#include <Eigen/Core>

#include "localisation/odometry.h"

namespace twocone::estimation {

/// The pose that a robot steers by: odometry, with its position corrected by fixes that arrive some frames late
/// (the robot file's `latency_frames`).
///
/// A fix gives the position at its frame, so the correction is its difference from the odometry of that frame. Only a
/// share of the difference is applied at a time, because steering needs a smooth pose and one wrong fix must not shift
/// it far. The heading is that of the odometry.
class BelievedPose {
 public:
  /// Share of each correction. The noise of the fixes is averaged over about 1 / kShare of them.
  static constexpr double kShare = 0.2;

  void add_odometry(std::uint64_t frame, const localisation::Pose& pose);
  /// @param frame a frame that add_odometry received, not older than that of the latest fix
  void add_fix(std::uint64_t frame, const Eigen::Vector2d& position_m);

  /// Returns the newest odometry, corrected.
  [[nodiscard]] localisation::Pose pose() const;

 private:
  struct Entry {
    std::uint64_t frame;
    localisation::Pose pose;
  };
  std::deque<Entry> odometry_;  ///< from the frame of the latest fix on
  Eigen::Vector2d correction_m_ = Eigen::Vector2d::Zero();
};

}  // namespace twocone::estimation

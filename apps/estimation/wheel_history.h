// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>

#include <Eigen/Core>

#include "hal/diff_drive.h"
#include "localisation/odometry.h"

namespace twocone::estimation {

/// Returns the wheel angles at the time an image was taken. A frame arrives some time after its exposure, and the
/// wheels are read after it has arrived. At half a metre per second, a delay of 50 ms would place the frame 25 mm too
/// far ahead.
class WheelHistory {
 public:
  /// Adds a reading. Readings must be in time order and of one clock.
  void add(const WheelAngles& reading);
  /// Interpolates between the two readings around `time`, as if the wheels had turned at constant speed. Before the
  /// first and after the last reading, it returns that reading. Requires at least one reading.
  /// @throws std::invalid_argument for a time of another clock
  [[nodiscard]] WheelAngles at(Timestamp time) const;

 private:
  // Longer than the delay of any camera.
  static constexpr std::chrono::seconds kKept{5};
  std::deque<WheelAngles> readings_;
};

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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "apps/files/robot_file.h"
#include "apps/runs/estimator.h"
#include "apps/runs/run_data.h"
#include "localisation/pose_filter.h"

namespace twocone::runs {

/// track.csv and estimate.tum, frame by frame: what the robot takes for its pose, the fixes of single frames and the
/// wheels together, and what became of each fix.
///
/// Method `full`: localisation::PoseFilter. Method `paper`: the fix with the odometry's heading, as the paper has no
/// filter; of two answers nobody knows which is right, and neither is an estimate.
class Track {
 public:
  /// @throws std::invalid_argument for wheels that the filter refuses
  Track(Method method, const files::Robot& robot);

  /// @param drive,odometry of the frame that `fix` was made from; frames come in order
  /// @throws std::invalid_argument as PoseFilter::predict
  TrackRow follow(std::uint64_t frame, const DriveRow& drive, const PoseRow& odometry, const localisation::Fix& fix);

 private:
  std::optional<localisation::PoseFilter> filter_;
};

/// A fix by itself, for a run without odometry: no pose for one without position or heading, for one of two answers,
/// and for one whose position is not meant to be used (localisation::is_place).
TrackRow track_row(std::uint64_t frame, double t_s, const localisation::Fix& fix);

}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "apps/config/robot_file.h"
#include "apps/estimation/method.h"
#include "localisation/fix.h"
#include "localisation/pose_filter.h"

namespace twocone::estimation {

/// The robot's pose at a frame from all data so far, and the use of the frame's fix.
struct TrackAnswer {
  localisation::FixUse use = localisation::FixUse::kNoFix;
  std::optional<localisation::FilterState> state{};  ///< empty without a filter
  std::optional<Eigen::Vector2d> position_m{};       ///< world frame
  std::optional<double> heading_rad{};               ///< (-pi, pi]
  std::optional<Eigen::Matrix3d> covariance{};       ///< of (x m, y m, heading rad); empty without a filter
};

/// Combines the fixes of single frames with the wheel angles, frame by frame.
///
/// Method `outline` uses localisation::PoseFilter. Method `paper` uses the fix with the odometry's heading, because the
/// paper has no filter. If a fix has two positions, it is unknown which is right, and neither is an estimate.
class Track {
 public:
  /// @throws std::invalid_argument for wheels that the filter rejects
  Track(Method method, const config::Robot& robot);

  /// @param t_s time of the frame, increasing
  /// @param left_rad, right_rad angles that the wheels have turned until then
  /// @param odometry_heading_rad heading from the wheels alone
  /// @throws std::invalid_argument as PoseFilter::predict
  TrackAnswer follow(double t_s, double left_rad, double right_rad, double odometry_heading_rad,
                     const localisation::Fix& fix);

 private:
  std::optional<localisation::PoseFilter> filter_;
};

/// Returns the fix alone, for a run without odometry. The answer has no pose if the fix has no position or no heading,
/// if it has two positions, or if its position must not be used (localisation::is_place).
TrackAnswer track_without_wheels(const localisation::Fix& fix);

}  // namespace twocone::estimation

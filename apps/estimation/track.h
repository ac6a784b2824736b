// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>

#include <Eigen/Core>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/estimation/method.h"
#include "hal/diff_drive.h"
#include "localisation/fix.h"
#include "localisation/odometry.h"
#include "localisation/plan_fix.h"
#include "localisation/pose_filter.h"
#include "vision/beam.h"

namespace twocone::estimation {

/// The robot's pose at a frame, computed from all data so far, and the use of the frame's fix.
struct TrackAnswer {
  localisation::FixUse use = localisation::FixUse::kNoFix;
  std::optional<localisation::FixUse> plan_use{};    ///< of the pose by the floor plan; with estimator.plan
  std::optional<localisation::FilterState> state{};  ///< empty without a filter
  std::optional<Eigen::Vector2d> position_m{};       ///< world frame
  std::optional<double> heading_rad{};               ///< (-pi, pi]
  std::optional<Eigen::Matrix3d> covariance{};       ///< of (x m, y m, heading rad); empty without a filter
};

/// Returns the pose at which the ends of the beams lie on the floor plan, or nothing (localisation::fix_by_plan).
/// @param is_vague whether the expected pose may be 0.3 m and 10 degrees off: the search starts around it then, at 45
/// places. Otherwise it may be 0.2 m off.
std::optional<localisation::PlanFix> place_on_plan(const localisation::FloorPlan& plan,
                                                   const std::vector<vision::Beam>& beams,
                                                   const localisation::Pose& expected, bool is_vague);

/// Combines the fixes of single frames with the wheel angles, frame by frame.
///
/// Method `outline` uses localisation::PoseFilter. Method `paper` uses the position of the fix with the odometry's
/// heading, because the paper has no filter. If a fix has two positions, neither is used as the estimate, because it is
/// unknown which one is right.
///
/// With estimator.plan, the pose at which the frame's scan lies on the map's floor plan is used after the fix, as a
/// second source of PoseFilter: the walls are where they are in all frames, so that its errors do not average away, and
/// a scan that is matched with the wrong walls looks like a right one, so that landmarks decide where there are any.
/// Without an estimate, the search starts from the start of the robot file, moved as the wheels turned.
class Track {
 public:
  /// @throws std::invalid_argument for wheels that the filter rejects
  Track(Method method, const config::Robot& robot, const config::Map& map);

  /// Adds a frame and returns the pose at its time.
  /// @param t_s time of the frame, later than that of the frame before
  /// @param left_rad, right_rad total angles that the wheels have turned until then
  /// @param odometry_heading_rad heading from the wheels alone
  /// @param scan with estimator.plan, that of the frame; empty: none
  /// @throws std::invalid_argument as PoseFilter::predict
  TrackAnswer follow(double t_s, double left_rad, double right_rad, double odometry_heading_rad,
                     const localisation::Fix& fix, const std::vector<vision::Beam>& scan = {});

 private:
  struct Plan {
    localisation::FloorPlan walls;
    localisation::Odometry from_start;
  };
  localisation::FixUse follow_plan(const std::vector<vision::Beam>& scan);

  std::optional<localisation::PoseFilter> filter_;
  std::optional<Plan> plan_;
};

/// Returns the fix alone, for a run without odometry. The answer has no pose if the fix has no position or no heading,
/// if it has two positions, or if its position must not be used (localisation::is_place).
TrackAnswer track_without_wheels(const localisation::Fix& fix);

/// Stores wheel readings, and returns the wheel angles at the time of an image's exposure. A frame arrives some time
/// after its exposure, and the wheels are read after it has arrived. At half a metre per second, a delay of 50 ms would
/// place the frame 25 mm too far ahead.
class WheelHistory {
 public:
  /// Adds a reading. Readings must be in order of time and from one clock.
  void add(const WheelAngles& reading);
  /// Interpolates between the two readings around `time`, as if the wheels turned at constant speed. Before the first
  /// reading it returns the first one, and after the last reading the last one. Requires at least one reading.
  /// @throws std::invalid_argument for a time of another clock
  [[nodiscard]] WheelAngles at(Timestamp time) const;

 private:
  // Longer than the delay of any camera.
  static constexpr std::chrono::seconds kKept{5};
  std::deque<WheelAngles> readings_;
};

/// The pose that a robot uses to steer: odometry, with a position that fixes correct. A fix arrives some frames late
/// (`latency_frames` in the robot file).
///
/// A fix gives the position at its frame, so the correction is its difference from the odometry of that frame. Only a
/// share of the difference is applied at a time, because steering needs a smooth pose and one wrong fix must not shift
/// it far. The heading is that of the odometry. An estimate of the whole pose, instead, is believed as it is.
class BelievedPose {
 public:
  /// Share of each correction that is applied. The noise of the fixes is averaged over about 1 / kShare of them.
  static constexpr double kShare = 0.2;

  void add_odometry(std::uint64_t frame, const localisation::Pose& pose);
  /// Adds a fix. @param frame a frame that add_odometry received, not older than that of the latest fix
  void add_fix(std::uint64_t frame, const Eigen::Vector2d& position_m);

  /// Adds an estimate of the pose at a frame, likewise.
  void add_estimate(std::uint64_t frame, const localisation::Pose& pose);

  /// Returns the newest odometry with the correction. Requires at least one pose of odometry.
  [[nodiscard]] localisation::Pose pose() const;
  /// Returns the believed pose at a frame, as add_fix.
  [[nodiscard]] localisation::Pose pose_at(std::uint64_t frame) { return corrected(odometry_at(frame)); }

 private:
  struct Entry {
    std::uint64_t frame;
    localisation::Pose pose;
  };
  const localisation::Pose& odometry_at(std::uint64_t frame);
  [[nodiscard]] Eigen::Vector2d turned_m(const localisation::Pose& odometry) const;
  [[nodiscard]] localisation::Pose corrected(const localisation::Pose& odometry) const;

  std::deque<Entry> odometry_;  ///< from the frame of the latest fix on
  Eigen::Vector2d correction_m_ = Eigen::Vector2d::Zero();
  double turn_rad_ = 0;  ///< of the odometry's world into the believed one, before correction_m_
};

}  // namespace twocone::estimation

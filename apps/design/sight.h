// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "base/plane.h"
#include "vision/mirror_view.h"
#include "vision/uncertain_rig.h"

/// The design of rigs: what a pair of mirrors sees, how accurately, and the measures of a pair that does what is
/// required.
namespace twocone::design {

/// Elevations that a view shows, from its eye (the point V of vision::MirrorView), straight ahead.
struct Elevations {
  double lowest_rad, highest_rad;
};
/// Returns those of an upright view, without the innermost pixels (vision::kInnermost_px).
Elevations elevations_of(const vision::MirrorView& view);

/// Heights over the floor.
struct Heights {
  double lowest_m, highest_m;
};

/// What both mirrors of a rig see straight ahead, in the upright plane through the body's x axis: a point at a
/// horizontal distance from the body's origin and a height over the floor.
class Sight {
 public:
  explicit Sight(vision::Rig rig) : rig_(std::move(rig)) {}

  [[nodiscard]] const vision::Rig& rig() const { return rig_; }
  /// Returns whether a view shows the point, at least vision::kInnermost_px from the tip.
  [[nodiscard]] bool shows(vision::Side side, double distance_m, double height_m) const;
  /// Returns the heights that both views show at a distance, between the floor and 10 m; to the millimetre.
  [[nodiscard]] std::optional<Heights> shared_heights(double distance_m) const;
  /// Returns the least distance from which on both views show the floor, up to `farthest_m`; nothing if they do not.
  [[nodiscard]] std::optional<double> floor_from_m(double farthest_m = 20) const;

  /// Returns the standard deviation of the horizontal range of a point that both views show, from its pixels alone:
  /// least squares for bearing, range and height with pixels of sigma_px / sqrt(2) in either direction, so that
  /// sigma_px is the standard deviation of a disparity. Nothing where a view does not show the point.
  [[nodiscard]] std::optional<double> range_sigma_m(double distance_m, double height_m, double sigma_px) const;
  /// Returns the error of the range, m, that an error of 1 (m, rad or px) of each rig number causes, by
  /// vision::RigNumber: wrong minus true, where the believed number is larger than the true one. Nothing as above.
  [[nodiscard]] std::optional<Eigen::VectorXd> range_per_number(double distance_m, double height_m) const;

 private:
  struct Solution;
  [[nodiscard]] std::optional<Solution> solve(double distance_m, double height_m) const;

  vision::Rig rig_;
};

/// Where ranges begin, straight ahead. Nothing: nowhere up to 6 m.
struct Reach {
  std::optional<double> nearest_m;       ///< where both views begin to show something in common
  std::optional<double> floor_from_m;    ///< as Sight::floor_from_m()
  std::optional<double> least_height_m;  ///< both views show nothing that is lower, at no distance
};
Reach reach_of(const Sight& sight);
/// Returns a sentence without its end: "both mirrors range from 0.90 m on, and nothing lower than 0.70 m".
std::string words_of(const Reach& reach);

/// A distance with what both views see there.
struct AtDistance {
  double distance_m;
  std::optional<Heights> shared;                      ///< nothing: no height
  std::optional<double> least_sigma_m, most_sigma_m;  ///< of the range, over those heights
};

/// Where the range of what both mirrors show has one standard deviation: straight ahead, by rising height.
struct SigmaLine {
  double sigma_m;
  std::vector<Eigen::Vector2d> points_m;  ///< distance, height
};

/// The error of a range by the sigma of one number of the rig.
struct Sensitivity {
  std::string number;  ///< its key in a robot file
  double sigma;        ///< of the number, m, rad or px
  std::string unit;
  double range_m;  ///< standard deviation of the range
};

/// Where a robot sees its own place how accurately.
struct RoomCell {
  double x_m, y_m;
  int landmarks;                  ///< that both mirrors show
  std::optional<double> sigma_m;  ///< of the position, sqrt(var x + var y), by the pixels' noise alone; nothing: none
  std::optional<double> heading_rad;    ///< standard deviation
  std::optional<double> whole_sigma_m;  ///< with the stated sigmas of rig and landmarks
};
struct RoomSigmas {
  double step_m;
  std::vector<RoomCell> cells;  ///< where the body has room
};

struct AnalysisSettings {
  double sigma_px = 0.15;      ///< standard deviation of a disparity, > 0
  double edge_noise_px = 0.1;  ///< of landmarks' outlines, per pixel of their length, > 0
  double at_m = 3;             ///< distance of the sensitivities, > 0
  double room_step_m = 0.1;    ///< > 0
};

/// What a robot's rig can do.
struct Analysis {
  Reach reach;
  std::vector<AtDistance> distances;
  std::vector<SigmaLine> lines;       ///< of 1, 2, 5, 10, 20, 50 and 100 mm, up to 6 m away, where there are any
  std::optional<double> at_height_m;  ///< of the sensitivities, the middle of what both see at AnalysisSettings::at_m
  std::vector<Sensitivity> sensitivities;  ///< by falling error
  std::optional<RoomSigmas> room;
};

/// @param map nothing: no room. Its obstacles take room, but hide nothing, because a map states no heights of them
/// @throws std::invalid_argument naming each setting outside its domain; config::FileError for a rig that vision
/// rejects
Analysis analyse(const config::Robot& robot, const std::optional<config::Map>& map, const AnalysisSettings& settings);

}  // namespace twocone::design

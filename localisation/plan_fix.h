// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "base/plane.h"
#include "localisation/odometry.h"

namespace twocone::localisation {

/// What a floor plan shows: walls and sides of things as straight edges, and round things. World frame.
struct FloorPlan {
  struct Edge {
    Eigen::Vector2d from_m, to_m;
  };
  std::vector<Edge> edges;
  std::vector<Disc> discs;
};

/// A place where a scan ended, in order of bearing.
struct ScanPoint {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< body frame
  double sigma_m = 0;                                 ///< of its range, > 0
};

/// A pose by a floor plan.
struct PlanFix {
  Pose pose;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< of x (m), y (m), heading (rad)
  int used = 0;                                              ///< points that lie on the plan
  double rms_m = 0;                                          ///< of their distances from it
};

struct PlanSettings {
  double plan_sigma_m = 0.035;  ///< standard deviation of an edge's place, >= 0
  int least_points = 30;        ///< on the plan; fewer give no pose, >= 3
  double least_share = 0.3;     ///< of all points, likewise, 0 to 1
};

/// Returns the pose at which the points of a scan lie on the plan: iterated closest points (Besl and McKay 1992) with
/// distances to edges, by least squares with Cauchy's weights, whose width shrinks from `reach_m` to what the sigmas
/// are. What stands in the room and is not in the plan is an outlier. Nothing where too few points lie on the plan, or
/// where the plan leaves a direction open, as a corridor without ends does.
///
/// The covariance is that of the sum of the points' scores with their neighbours (a sandwich, Newey and West 1987):
/// neighbours along a wall have common errors, for its ranges' sake; and plan_sigma_m moves all of them together.
/// @param expected where the search starts
/// @param reach_m farthest distance of a point from its edge there, > 0
/// @throws std::invalid_argument naming every argument outside its domain
std::optional<PlanFix> fix_by_plan(const FloorPlan& plan, const std::vector<ScanPoint>& points, const Pose& expected,
                                   double reach_m, const PlanSettings& settings = {});

/// Returns the best of such fixes from starts around the expected pose, that are as far from it as it may be wrong.
std::optional<PlanFix> find_by_plan(const FloorPlan& plan, const std::vector<ScanPoint>& points, const Pose& expected,
                                    double off_m, double off_rad, const PlanSettings& settings = {});

}  // namespace twocone::localisation

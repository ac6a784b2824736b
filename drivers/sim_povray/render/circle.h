// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace twocone::sim_povray {

/// A pixel's centre.
struct Spot {
  double column_px = 0;
  double row_px = 0;
};

struct Circle {
  Spot centre;
  double radius_px = 0;
};

/// Corners of the points' convex hull, in turn; collinear points are left out.
std::vector<Spot> convex_hull(std::vector<Spot> points);

/// The smallest circle that no point is outside of (Welzl's). @param points at least one
Circle enclosing_circle(const std::vector<Spot>& points);

/// The circle nearest to the points in the least squares of distance squared (Kasa 1976). @param points at least three,
/// not on one line
Circle fitted_circle(const std::vector<Spot>& points);

/// Farthest that a point is from the centre.
double farthest_px(const std::vector<Spot>& points, const Spot& centre);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <vector>

namespace twocone::sim_povray {

/// A pixel's centre.
struct Spot {
  double column_px = 0;
  double row_px = 0;

  // clang-tidy 14 mistakes the zero in its comparison for a pointer.
  friend auto operator<=>(const Spot&, const Spot&) = default;  // NOLINT(modernize-use-nullptr)
};

struct Circle {
  Spot centre;
  double radius_px = 0;
};

/// Returns the corners of the points' convex hull, in order; collinear points are left out.
std::vector<Spot> convex_hull(std::vector<Spot> points);

/// Returns the smallest circle that contains all points (Welzl's). @param points at least one
Circle enclosing_circle(const std::vector<Spot>& points);

/// Returns the circle nearest to the points in the least squares of distance squared (Kasa 1976). @param points at
/// least three, not on one line
Circle fitted_circle(const std::vector<Spot>& points);

/// Returns the greatest distance of a point from the centre.
double farthest_px(const std::vector<Spot>& points, const Spot& centre);

}  // namespace twocone::sim_povray

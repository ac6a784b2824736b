// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/circle.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace twocone::sim_povray {
namespace {

double cross(const Spot& o, const Spot& a, const Spot& b) {
  return (a.column_px - o.column_px) * (b.row_px - o.row_px) - (a.row_px - o.row_px) * (b.column_px - o.column_px);
}

double distance(const Spot& a, const Spot& b) { return std::hypot(a.column_px - b.column_px, a.row_px - b.row_px); }

bool holds(const Circle& circle, const Spot& point) {
  constexpr double kRounding_px = 1e-9;  // rounding of coordinates below 1e5
  return distance(circle.centre, point) <= circle.radius_px + kRounding_px;
}

Circle through(const Spot& a, const Spot& b) {
  return {{(a.column_px + b.column_px) / 2, (a.row_px + b.row_px) / 2}, distance(a, b) / 2};
}

Circle through(const Spot& a, const Spot& b, const Spot& c) {
  const double bx = b.column_px - a.column_px, by = b.row_px - a.row_px;
  const double cx = c.column_px - a.column_px, cy = c.row_px - a.row_px;
  const double d = 2 * (bx * cy - by * cx);
  if (d == 0) {  // on one line: the circle through the two farthest points
    const std::vector<Circle> pairs{through(a, b), through(b, c), through(a, c)};
    return *std::ranges::max_element(pairs, {}, &Circle::radius_px);
  }
  const double b2 = bx * bx + by * by, c2 = cx * cx + cy * cy;
  const double ux = (cy * b2 - by * c2) / d, uy = (bx * c2 - cx * b2) / d;
  return {{a.column_px + ux, a.row_px + uy}, std::hypot(ux, uy)};
}

}  // namespace

std::vector<Spot> convex_hull(std::vector<Spot> points) {
  std::ranges::sort(points);
  if (points.size() < 3) return points;
  std::vector<Spot> hull(2 * points.size());
  std::size_t n = 0;
  for (const Spot& p : points) {
    while (n >= 2 && cross(hull[n - 2], hull[n - 1], p) <= 0) --n;
    hull[n++] = p;
  }
  const std::size_t lower = n + 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) {
    while (n >= lower && cross(hull[n - 2], hull[n - 1], points[i]) <= 0) --n;
    hull[n++] = points[i];
  }
  hull.resize(n - 1);
  return hull;
}

Circle enclosing_circle(const std::vector<Spot>& points) {
  Circle circle{points.front(), 0};
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (holds(circle, points[i])) continue;
    circle = {points[i], 0};
    for (std::size_t j = 0; j < i; ++j) {
      if (holds(circle, points[j])) continue;
      circle = through(points[i], points[j]);
      for (std::size_t k = 0; k < j; ++k) {
        if (!holds(circle, points[k])) circle = through(points[i], points[j], points[k]);
      }
    }
  }
  return circle;
}

Circle fitted_circle(const std::vector<Spot>& points) {
  const auto n = double(points.size());
  Spot mean;
  for (const Spot& p : points) {
    mean.column_px += p.column_px / n;
    mean.row_px += p.row_px / n;
  }
  double xx = 0, xy = 0, yy = 0, xz = 0, yz = 0, zz = 0;
  for (const Spot& p : points) {
    const double x = p.column_px - mean.column_px, y = p.row_px - mean.row_px, z = x * x + y * y;
    xx += x * x, xy += x * y, yy += y * y, xz += x * z, yz += y * z, zz += z;
  }
  const double d = 2 * (xx * yy - xy * xy);
  const double x = (yy * xz - xy * yz) / d, y = (xx * yz - xy * xz) / d;
  return {{mean.column_px + x, mean.row_px + y}, std::sqrt(x * x + y * y + zz / n)};
}

double farthest_px(const std::vector<Spot>& points, const Spot& centre) {
  double farthest = 0;
  for (const Spot& p : points) farthest = std::max(farthest, distance(p, centre));
  return farthest;
}

}  // namespace twocone::sim_povray

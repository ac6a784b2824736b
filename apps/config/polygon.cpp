// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>

#include "apps/config/map_file.h"

namespace twocone::config {
namespace {

/// Returns twice the signed area of the triangle: > 0 if it is counter-clockwise.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m);
}

/// Requires `p` in line with a and b. Returns whether it lies between them, ends included.
bool is_between(const Point& p, const Point& a, const Point& b) {
  return std::min(a.x_m, b.x_m) <= p.x_m && p.x_m <= std::max(a.x_m, b.x_m) && std::min(a.y_m, b.y_m) <= p.y_m &&
         p.y_m <= std::max(a.y_m, b.y_m);
}

bool meet(const Point& a, const Point& b, const Point& c, const Point& d) {
  const double abc = turn(a, b, c);
  const double abd = turn(a, b, d);
  const double cda = turn(c, d, a);
  const double cdb = turn(c, d, b);
  // The signs are compared, because a product of two small areas would underflow.
  const auto apart = [](double p, double q) { return (p > 0 && q < 0) || (p < 0 && q > 0); };
  if (apart(abc, abd) && apart(cda, cdb)) return true;
  return (abc == 0 && is_between(c, a, b)) || (abd == 0 && is_between(d, a, b)) || (cda == 0 && is_between(a, c, d)) ||
         (cdb == 0 && is_between(b, c, d));
}

bool is_same(const Point& a, const Point& b) { return a.x_m == b.x_m && a.y_m == b.y_m; }

/// Returns whether the edge b-c runs back over a-b.
bool folds_back(const Point& a, const Point& b, const Point& c) {
  const double along = (a.x_m - b.x_m) * (c.x_m - b.x_m) + (a.y_m - b.y_m) * (c.y_m - b.y_m);
  return turn(a, b, c) == 0 && along > 0;
}

}  // namespace

bool is_simple(const Polygon& corners) {
  const std::size_t count = corners.size();
  if (count < 3) return false;
  const auto corner = [&](std::size_t i) -> const Point& { return corners[i % count]; };
  for (std::size_t i = 0; i < count; ++i) {
    if (is_same(corner(i), corner(i + 1)) || folds_back(corner(i), corner(i + 1), corner(i + 2))) return false;
    // Skips the edges next to edge i. The last edge is next to edge 0.
    for (std::size_t j = i + 2; j < count && j - i < count - 1; ++j) {
      if (meet(corner(i), corner(i + 1), corner(j), corner(j + 1))) return false;
    }
  }
  return true;
}

}  // namespace twocone::config

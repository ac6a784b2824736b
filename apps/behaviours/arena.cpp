// SPDX-License-Identifier: Apache-2.0
#include "apps/behaviours/arena.h"

#include <algorithm>
#include <limits>

namespace twocone::behaviours {
namespace {

double distance_to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (p - (a + t * along)).norm();
}

/// Returns the signed distance, negative inside the outline. The even-odd rule decides what is inside.
double distance_to_outline(const Eigen::Vector2d& p, const Outline& outline) {
  double nearest = std::numeric_limits<double>::infinity();
  bool inside = false;
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const Eigen::Vector2d& a = outline[j];
    const Eigen::Vector2d& b = outline[i];
    nearest = std::min(nearest, distance_to_segment(p, a, b));
    const bool crosses = (a.y() > p.y()) != (b.y() > p.y());
    if (crosses && p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y())) inside = !inside;
  }
  return inside ? -nearest : nearest;
}

}  // namespace

double Arena::clearance_m(const Eigen::Vector2d& p_m) const {
  double least = std::min((p_m - min_m).minCoeff(), (max_m - p_m).minCoeff());
  for (const Outline& outline : outlines) least = std::min(least, distance_to_outline(p_m, outline));
  for (const Disc& disc : discs) {
    const Eigen::Vector2d centre_m(disc.centre.x_m, disc.centre.y_m);
    least = std::min(least, (p_m - centre_m).norm() - disc.radius_m);
  }
  return least;
}

}  // namespace twocone::behaviours

// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/surroundings.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <limits>

namespace twocone::sim_povray {
namespace {

Facing from_point(const FloorPoint& from, const FloorPoint& point, double radius_m) {
  const double x_m = point.x_m - from.x_m;
  const double y_m = point.y_m - from.y_m;
  const double away_m = std::sqrt(x_m * x_m + y_m * y_m);
  if (away_m == 0) return {-radius_m, 0, 0};
  return {away_m - radius_m, x_m / away_m, y_m / away_m};
}

/// Returns whether the outline contains the point, by the number of edges that a ray to the right crosses.
bool is_inside(const Outline& outline, const FloorPoint& point) {
  bool inside = false;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const FloorPoint& a = outline[i];
    const FloorPoint& b = outline[(i + 1) % outline.size()];
    if ((a.y_m > point.y_m) == (b.y_m > point.y_m)) continue;
    if (point.x_m < a.x_m + (point.y_m - a.y_m) / (b.y_m - a.y_m) * (b.x_m - a.x_m)) inside = !inside;
  }
  return inside;
}

}  // namespace

Facing facing(const HalfPlane& wall, const FloorPoint& point) {
  return {wall.x_n * point.x_m + wall.y_n * point.y_m - wall.offset_m, wall.x_n, wall.y_n};
}

Facing facing(const Disc& disc, const FloorPoint& point) { return from_point(disc.centre, point, disc.radius_m); }

Facing facing(const Edge& edge, const FloorPoint& point) {
  const double x_m = edge.to.x_m - edge.from.x_m;
  const double y_m = edge.to.y_m - edge.from.y_m;
  const double square = x_m * x_m + y_m * y_m;
  const double along = (point.x_m - edge.from.x_m) * x_m + (point.y_m - edge.from.y_m) * y_m;
  if (along <= 0) return from_point(edge.from, point, 0);
  if (along >= square) return from_point(edge.to, point, 0);
  // The direction is computed across the edge's line. From the foot, a rounding by an ulp would turn the direction to a
  // near point.
  const double length_m = std::sqrt(square);
  const double across_m = (x_m * (point.y_m - edge.from.y_m) - y_m * (point.x_m - edge.from.x_m)) / length_m;
  if (across_m == 0) return {};
  const double side = across_m > 0 ? 1 : -1;
  return {std::abs(across_m), -side * y_m / length_m, side * x_m / length_m};
}

Surroundings::Surroundings(const PlaceSettings& place) {
  if (place.walls) {
    names_.push_back("wall");
    const Bounds& w = *place.walls;
    for (const HalfPlane& wall : {HalfPlane{1, 0, w.min_x_m}, HalfPlane{-1, 0, -w.max_x_m}, HalfPlane{0, 1, w.min_y_m},
                                  HalfPlane{0, -1, -w.max_y_m}}) {
      parts_.push_back({wall, 0});
    }
  }
  for (const Solid& solid : place.solids) {
    const std::size_t owner = names_.size();
    names_.push_back(solid.name);
    if (const auto* disc = std::get_if<Disc>(&solid.shape)) {
      parts_.push_back({*disc, owner});
      continue;
    }
    const auto& outline = std::get<Outline>(solid.shape);
    for (std::size_t i = 0; i < outline.size(); ++i) {
      parts_.push_back({Edge{outline[i], outline[(i + 1) % outline.size()]}, owner});
    }
    outlines_.push_back({outline, owner});
  }
}

const std::string* Surroundings::outline_around(const FloorPoint& point) const {
  const auto around =
      std::ranges::find_if(outlines_, [&point](const NamedOutline& o) { return is_inside(o.outline, point); });
  return around == outlines_.end() ? nullptr : &names_[around->owner];
}

MovingPath::MovingPath(const MovingThing& thing) : speed_mps_(thing.speed_mps), loop_(thing.loop) {
  assert(thing.path_m.size() >= 2);
  const std::size_t points = thing.path_m.size();
  for (std::size_t i = 0; i + (loop_ ? 0 : 1) < points; ++i) {
    const FloorPoint from = thing.path_m[i];
    const FloorPoint to = thing.path_m[(i + 1) % points];
    const double length_m = std::hypot(to.x_m - from.x_m, to.y_m - from.y_m);
    if (length_m == 0) continue;  // a loop whose last point equals its first has no segment back
    segments_.push_back({from, total_m_, length_m, (to.x_m - from.x_m) / length_m, (to.y_m - from.y_m) / length_m});
    total_m_ += length_m;
  }
}

MovingPath::Place MovingPath::place(double time_s) const {
  double way_m = speed_mps_ * std::max(time_s, 0.0);
  if (loop_) {
    way_m = std::fmod(way_m, total_m_);
  } else if (way_m >= total_m_) {
    return {&segments_.back(), segments_.back().length_m, true};
  }
  const auto next = std::ranges::upper_bound(segments_, way_m, {}, &Segment::begin_m);
  const Segment& segment = *std::prev(next);
  return {&segment, way_m - segment.begin_m, false};
}

Pose2 MovingPath::pose(double time_s) const {
  const Place at = place(time_s);
  const FloorPoint point = at.point();
  return {point.x_m, point.y_m, std::atan2(at.segment->y, at.segment->x)};
}

Stretch MovingPath::stretch(double time_s) const {
  const Place at = place(time_s);
  if (at.ended) return {at.point(), 0, 0, 0, std::numeric_limits<double>::infinity()};
  return {at.point(), speed_mps_ * at.segment->x, speed_mps_ * at.segment->y, 0,
          time_s + (at.segment->length_m - at.along_m) / speed_mps_};
}

}  // namespace twocone::sim_povray

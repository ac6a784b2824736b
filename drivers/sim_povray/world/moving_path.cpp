// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/moving_path.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace twocone::sim_povray {

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

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
    if (length_m == 0) continue;  // a loop whose last point is its first has no way back to go
    legs_.push_back({from, total_m_, length_m, (to.x_m - from.x_m) / length_m, (to.y_m - from.y_m) / length_m});
    total_m_ += length_m;
  }
}

MovingPath::Place MovingPath::place(double time_s) const {
  double way_m = speed_mps_ * std::max(time_s, 0.0);
  if (loop_) {
    way_m = std::fmod(way_m, total_m_);
  } else if (way_m >= total_m_) {
    return {&legs_.back(), legs_.back().length_m, true};
  }
  const auto next =
      std::upper_bound(legs_.begin(), legs_.end(), way_m, [](double way, const Leg& leg) { return way < leg.begin_m; });
  const Leg& leg = *std::prev(next);
  return {&leg, way_m - leg.begin_m, false};
}

Pose2 MovingPath::pose(double time_s) const {
  const auto [leg, along_m, ended] = place(time_s);
  return {leg->from.x_m + along_m * leg->x, leg->from.y_m + along_m * leg->y, std::atan2(leg->y, leg->x)};
}

Stretch MovingPath::stretch(double time_s) const {
  const auto [leg, along_m, ended] = place(time_s);
  const FloorPoint at{leg->from.x_m + along_m * leg->x, leg->from.y_m + along_m * leg->y};
  if (ended) return {at, 0, 0, 0, std::numeric_limits<double>::infinity()};
  return {at, speed_mps_ * leg->x, speed_mps_ * leg->y, 0, time_s + (leg->length_m - along_m) / speed_mps_};
}

}  // namespace twocone::sim_povray

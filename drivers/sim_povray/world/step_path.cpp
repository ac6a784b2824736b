// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/step_path.h"

#include <algorithm>
#include <iterator>

namespace twocone::sim_povray {

void StepPath::begin_at(const Pose2& here, std::chrono::nanoseconds step) {
  span = step;
  begin = end = here;
  arcs.clear();
  waypoints.clear();
  stopped_s.reset();
}

const StepPath::Arc* StepPath::arc_at(double time_s) const {
  if (stopped_s && time_s >= *stopped_s) return nullptr;
  const auto next = std::upper_bound(arcs.begin(), arcs.end(), time_s,
                                     [](double time, const Arc& arc) { return time < arc.begin_s; });
  if (next == arcs.begin() || time_s >= std::prev(next)->end_s) return nullptr;
  return &*std::prev(next);
}

Pose2 StepPath::pose_at(double time_s) const {
  if (!waypoints.empty()) {
    const auto next = std::upper_bound(waypoints.begin(), waypoints.end(), time_s,
                                       [](double time, const Waypoint& w) { return time < w.time_s; });
    if (next == waypoints.end()) return end;
    if (next == waypoints.begin()) return begin;
    const Waypoint& from = *std::prev(next);
    const double share = (time_s - from.time_s) / (next->time_s - from.time_s);
    return {from.pose.x_m + share * (next->pose.x_m - from.pose.x_m),
            from.pose.y_m + share * (next->pose.y_m - from.pose.y_m),
            wrap_angle(from.pose.heading_rad + share * wrap_angle(next->pose.heading_rad - from.pose.heading_rad))};
  }
  if (arcs.empty() || time_s <= arcs.front().begin_s) return begin;
  const Arc* arc = arc_at(time_s);
  if (arc == nullptr) return end;
  return time_s == arc->begin_s ? arc->from : advance(arc->from, arc->speeds, time_s - arc->begin_s);
}

}  // namespace twocone::sim_povray

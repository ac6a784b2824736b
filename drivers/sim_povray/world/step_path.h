// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <vector>

#include "drivers/sim_povray/world/motion.h"
#include "hal/pose.h"

namespace twocone::sim_povray {

/// The way of one robot over one step of the world. Times count from the step's beginning.
struct StepPath {
  /// From where it begins it goes on to the next one's beginning; the last one goes on to `end`.
  struct Arc {
    double begin_s, end_s;
    Pose2 from;
    BodySpeeds speeds;
  };
  /// Of a robot of the physics engine.
  struct Waypoint {
    double time_s;
    Pose2 pose;
  };

  std::chrono::nanoseconds span{0};
  Pose2 begin{};
  Pose2 end{};
  std::vector<Arc> arcs{};            ///< without gaps between them
  std::vector<Waypoint> waypoints{};  ///< in place of arcs
  std::optional<double> stopped_s{};  ///< from then on it stands, whatever the arcs say

  /// Standing at `here`. Keeps the lists' memory.
  void begin_at(const Pose2& here, std::chrono::nanoseconds step);
  /// None while it stands.
  [[nodiscard]] const Arc* arc_at(double time_s) const;
  [[nodiscard]] Pose2 pose_at(double time_s) const;
};

}  // namespace twocone::sim_povray

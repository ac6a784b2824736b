// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <vector>

#include "base/plane.h"
#include "drivers/sim_povray/world/motion.h"

namespace twocone::sim_povray {

/// The path of one robot over one step of the world. Times are measured from the step's beginning.
struct StepPath {
  /// An arc leads from its beginning to that of the next arc; the last one leads to `end`.
  struct Arc {
    double begin_s, end_s;
    Pose2 from;
    BodySpeeds speeds;
  };
  /// A pose of a robot of the physics engine.
  struct Waypoint {
    double time_s;
    Pose2 pose;
  };

  std::chrono::nanoseconds span{0};
  Pose2 begin{};
  Pose2 end{};
  std::vector<Arc> arcs{};            ///< without gaps between them
  std::vector<Waypoint> waypoints{};  ///< instead of arcs
  std::optional<double> stopped_s{};  ///< the robot stands from then on, whatever the arcs are

  /// Starts a step at `here`, standing. Keeps the lists' memory.
  void begin_at(const Pose2& here, std::chrono::nanoseconds step);
  /// Returns nullptr while the robot stands.
  [[nodiscard]] const Arc* arc_at(double time_s) const;
  [[nodiscard]] Pose2 pose_at(double time_s) const;
};

}  // namespace twocone::sim_povray

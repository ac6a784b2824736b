// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/plane.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/world/surroundings.h"

namespace twocone::sim_povray {

/// Pose of a moving thing at any time, in closed form: no error accumulates, so a run of a day ends at the right place.
/// At a corner the thing already faces along the next segment.
class MovingPath {
 public:
  explicit MovingPath(const MovingThing& thing);  // requires a checked thing

  [[nodiscard]] Pose2 pose(double time_s) const;
  /// Returns the straight stretch that it is on at a time of the world.
  [[nodiscard]] Stretch stretch(double time_s) const;

 private:
  struct Segment {
    FloorPoint from;
    double begin_m = 0;  ///< path length from path_m[0] to `from`
    double length_m = 0;
    double x = 0, y = 0;  ///< unit vector along it
  };
  struct Place {
    const Segment* segment;
    double along_m;  ///< from the segment's beginning
    bool ended;

    [[nodiscard]] FloorPoint point() const {
      return {segment->from.x_m + along_m * segment->x, segment->from.y_m + along_m * segment->y};
    }
  };
  [[nodiscard]] Place place(double time_s) const;

  std::vector<Segment> segments_;
  double total_m_ = 0;
  double speed_mps_;
  bool loop_;
};

}  // namespace twocone::sim_povray

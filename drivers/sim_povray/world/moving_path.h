// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "drivers/sim_povray/sim_povray.h"
#include "drivers/sim_povray/world/touch.h"

namespace twocone::sim_povray {

/// Where a moving thing is at any time, in closed form: nothing adds up, so a run of a day ends where it should. On a
/// corner it already faces along the next leg.
class MovingPath {
 public:
  explicit MovingPath(const MovingThing& thing);  // taken as checked

  [[nodiscard]] Pose2 pose(double time_s) const;
  /// The straight stretch that it is on, by world time.
  [[nodiscard]] Stretch stretch(double time_s) const;

 private:
  struct Leg {
    FloorPoint from;
    double begin_m = 0;  ///< way from path_m[0] to `from`
    double length_m = 0;
    double x = 0, y = 0;  ///< unit vector along it
  };
  struct Place {
    const Leg* leg;
    double along_m;  ///< from the leg's beginning
    bool ended;
  };
  [[nodiscard]] Place place(double time_s) const;

  std::vector<Leg> legs_;
  double total_m_ = 0;
  double speed_mps_;
  bool loop_;
};

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "apps/compare/matching.h"
#include "apps/compare/side.h"
#include "apps/compare/timing.h"

namespace twocone::compare {

/// The two runs with their timing and the frames of both that correspond to each other.
struct BothRuns {
  const Side& simulated;
  const Side& real;
  Timing simulated_timing{}, real_timing{};
  std::vector<Match> by_time{}, by_pose{};
  bool is_rendered = false;  ///< the simulated run was made by render_again()
};

}  // namespace twocone::compare

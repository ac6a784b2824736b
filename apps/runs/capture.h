// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "apps/runs/run_data.h"

namespace twocone::runs {

/// How a real robot's pairs came.
struct CaptureSummary {
  double rate_hz = 0;            ///< of the median time between pairs; 0 for fewer than two
  double jitter_p95_s = 0;       ///< 95 % of the times between pairs are within this of their median
  double skew_median_s = 0;      ///< of its absolute value
  double skew_max_s = 0;         ///< likewise
  std::uint64_t lower_lost = 0;  ///< exposures that were not recorded, those passed over among them
  std::uint64_t upper_lost = 0;
  CaptureCounts counts;
};

/// Nothing of a simulated robot, whose pairs come when they are asked for.
std::optional<CaptureSummary> summarise_capture(const RunData& run);

}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "apps/runlog/run_data.h"

namespace twocone::runlog {

/// Rate, skew and losses of a real robot's pairs.
struct CaptureSummary {
  double rate_hz = 0;            ///< of the median time between pairs; 0 for fewer than two
  double jitter_p95_s = 0;       ///< 95 % of the times between pairs are within this of their median
  double skew_median_s = 0;      ///< of its absolute value
  double skew_max_s = 0;         ///< likewise
  std::uint64_t lower_lost = 0;  ///< exposures that were not recorded, including skipped ones
  std::uint64_t upper_lost = 0;
  CaptureCounts counts;
};

/// Returns nothing for a simulated robot, whose pairs arrive on request.
std::optional<CaptureSummary> summarise_capture(const RunData& run);

}  // namespace twocone::runlog

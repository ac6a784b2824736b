// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/estimation/estimator.h"
#include "apps/runlog/run_data.h"

/// The table timing.csv and its statistics.
namespace twocone::runlog {

/// @param has_budget whether estimation::time_limit_of() returns a limit; then the row has a verdict
TimingRow to_row(std::uint64_t frame, double t_s, const estimation::Timing& timing, bool has_budget);

/// Returns a sentence about the frames that took longer than `budget_s`, or nothing if there are none.
std::optional<std::string> budget_event(const std::vector<TimingRow>& rows, double budget_s);

/// Statistics for the printed table and the report.
struct TimingSummary {
  int frames = 0;              ///< > 0
  double vision_median_s = 0;  ///< processor time
  double localisation_median_s = 0;
  double both_p95_s = 0;               ///< of vision and localisation of a frame together (nearest rank)
  std::optional<double> refined_mean;  ///< landmarks per frame; none for method paper, which has no stages
  int landmarks = 0;                   ///< number of landmarks to look for
  std::optional<double> budget_s;
  int kept = 0;  ///< frames within the time budget
};
/// Returns nothing for a run without timing.csv.
std::optional<TimingSummary> summarise_timing(const RunData& run);

}  // namespace twocone::runlog

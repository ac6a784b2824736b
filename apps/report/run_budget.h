// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/budget/budget.h"
#include "apps/runs/run_data.h"

namespace twocone::report {

/// The error budget of a run's robot where the run drove: at every `pose_step`-th frame (true poses; else the estimate;
/// else the odometry; a grid of the arena for a run without frames), at the run's own speed and turn rate (root mean
/// squares), with the noise of the outlines as this run measured it.
struct RunBudget {
  budget::Budget budget;
  double edge_noise_px = 0;
  bool noise_measured = false;  ///< median of sightings.csv; else BudgetSettings' own
  double speed_mps = 0;
  double turn_rate_radps = 0;
};
/// @param draws,pose_step >= 1. @throws as budget::error_budget
RunBudget budget_of(const runs::RunData& run, int draws, int pose_step);

/// As a table with a few sentences, HTML.
std::string budget_table(const RunBudget& run_budget);

}  // namespace twocone::report

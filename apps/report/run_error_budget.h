// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/error_budget/error_budget.h"
#include "apps/runlog/run_data.h"

namespace twocone::report {

/// The error budget of a run's robot on the path of the run. Its poses are every `pose_step`-th pose of the true path
/// (else of the estimate, else of the odometry; a grid over the arena for a run without frames). Its speed and turn
/// rate are the run's own (root mean squares), its noise of the outlines is the one that this run measured.
struct RunErrorBudget {
  error_budget::ErrorBudget error_budget;
  double edge_noise_px = 0;
  bool noise_measured = false;  ///< median of sightings.csv; else the default of ErrorBudgetSettings
  double speed_mps = 0;
  double turn_rate_radps = 0;
};
/// @param draws,pose_step >= 1. @throws as error_budget::error_budget
RunErrorBudget error_budget_of(const runlog::RunData& run, int draws, int pose_step);

/// Returns the error budget as an HTML table with a few sentences.
std::string error_budget_table(const RunErrorBudget& run_error_budget);

}  // namespace twocone::report

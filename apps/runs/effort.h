// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/files/robot_file.h"
#include "apps/runs/estimator.h"
#include "apps/runs/run_data.h"

/// What frames' answers took: effort.csv and what is said of it.
namespace twocone::runs {

/// What `robot.estimator` names, else kDefaultMethod.
Method method_of(const files::Robot& robot);

/// `robot` as a run with a time limit for each frame has it: stage `adaptive` of method `full`, whatever its file says.
/// @param method asked for. @throws std::invalid_argument for method paper, which has no stages to stop at, and for a
/// budget that is not > 0 and finite
files::Robot with_budget(files::Robot robot, Method method, double budget_s);

/// The time limit that answers of `method` have; none: any time.
std::optional<double> budget_of(Method method, const files::Robot& robot);

/// @param has_budget budget_of() is there: the row has a verdict
EffortRow to_row(std::uint64_t frame, double t_s, const Effort& effort, bool has_budget);

/// A sentence about the frames that took longer than `budget_s`; nothing if none did.
std::optional<std::string> budget_event(const std::vector<EffortRow>& rows, double budget_s);

/// What a terminal's table and the report say of it.
struct EffortSummary {
  int frames = 0;              ///< > 0
  double vision_median_s = 0;  ///< processor time
  double localisation_median_s = 0;
  double both_p95_s = 0;               ///< of vision and localisation of a frame together (nearest rank)
  std::optional<double> refined_mean;  ///< landmarks a frame; none of method paper, which has no stages
  int landmarks = 0;                   ///< that are looked for
  std::optional<double> budget_s;
  int kept = 0;  ///< frames within it
};
/// Empty for a run without effort.csv.
std::optional<EffortSummary> summarise_effort(const RunData& run);

}  // namespace twocone::runs

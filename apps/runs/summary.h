// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/runs/run_data.h"

namespace twocone::runs {

/// Of absolute errors; nothing is left out.
struct ErrorStatistics {
  int count = 0;
  double mean_m = 0;
  double rmse_m = 0;
  double p95_m = 0;  ///< 95 % of the errors are at most this (nearest rank)
  double max_m = 0;
};
/// Empty for no errors.
std::optional<ErrorStatistics> statistics(std::vector<double> errors_m);

struct LandmarkSummary {
  std::string name;
  std::map<std::string, int> verdicts;   ///< frames by verdict
  std::optional<ErrorStatistics> error;  ///< |range - true range| of the frames with a range; none without truth
  std::optional<double> mean_true_range_m;
};

/// What the table prints, as numbers (summary.json).
struct Summary {
  std::string method;
  int frames = 0;
  double duration_s = 0;
  std::vector<LandmarkSummary> landmarks;
  std::map<std::string, int> fix_verdicts;   ///< frames by verdict
  int frames_with_fix = 0;                   ///< frames with a position: ok, gap or ambiguous
  std::optional<ErrorStatistics> fix_error;  ///< of an ambiguous frame the worse answer; none without truth
  std::optional<ErrorStatistics> odometry_error;
  std::optional<double> travelled_m;           ///< length of the true path
  std::optional<double> headings_covered_deg;  ///< of 360, in bins of 10 degrees, of the true heading
};
Summary summarise(const RunData& run);

std::string to_json(const Summary& summary, const RunInfo& info);

}  // namespace twocone::runs

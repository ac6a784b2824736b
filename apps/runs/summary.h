// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/runs/capture.h"
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

/// The same of angles.
struct AngleStatistics {
  int count = 0;
  double mean_rad = 0;
  double rmse_rad = 0;
  double p95_rad = 0;
  double max_rad = 0;
};
/// Of absolute errors. Empty for none.
std::optional<AngleStatistics> angle_statistics(std::vector<double> errors_rad);

/// Over the frames that have both an answer and its Cramer-Rao bound (apps/runs/bounds.h), in the unit that the name of
/// the field says which holds it.
struct BoundComparison {
  int count = 0;
  double bound_rms = 0;        ///< > 0
  std::optional<double> rmse;  ///< of the errors of the same frames; none without truth
  [[nodiscard]] std::optional<double> ratio() const { return rmse ? std::optional(*rmse / bound_rms) : std::nullopt; }
};

/// How many answers a statement about them holds for.
struct Share {
  int held = 0;
  int count = 0;  ///< answers that state a sigma and have a truth, > 0
};

/// Of a normal distribution: 95 % lie within so many standard deviations.
constexpr double k95Sigmas = 1.959964;
/// Of chi-squared with two degrees of freedom: 95 % lie below, -2 ln 0.05.
constexpr double k95Ellipse = 5.991465;

struct LandmarkSummary {
  std::string name;
  std::map<std::string, int> verdicts;   ///< frames by verdict
  std::optional<ErrorStatistics> error;  ///< |range - true range| of the frames with a range; none without truth
  std::optional<double> mean_true_range_m;
  int frames_with_range = 0;
  int outliers = 0;  ///< frames in which its measurement was left out of the fix as wrong
  std::optional<BoundComparison> range_bound_m{};
  std::optional<Share> within_95{};  ///< ranges within k95Sigmas of their own stated sigma of the truth
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
  std::optional<double> travelled_m;              ///< length of the true path
  std::optional<double> headings_covered_deg;     ///< of 360, in bins of 10 degrees, of the true heading
  std::optional<AngleStatistics> heading_error;   ///< of fixes with a heading; of an ambiguous frame the worse answer
  std::optional<ErrorStatistics> estimate_error;  ///< of estimate.tum, at the frames that it has
  std::optional<AngleStatistics> estimate_heading_error;
  std::map<std::string, int>
      track_states{};  ///< frames by state of the track; none of an older run, nor without a filter
  std::map<std::string, int> track_uses{};          ///< frames by what became of their fix (localisation::FixUse)
  std::optional<BoundComparison> position_bound_m;  ///< distance, sqrt(var x + var y)
  std::optional<BoundComparison> heading_bound_rad;
  /// Fixes whose own 95 % ellipse holds the true position; of an ambiguous frame, one of the two. Those of verdict
  /// `weak` state none. A covariance that is not positive definite holds nothing.
  std::optional<Share> in_ellipse_95;
  std::optional<CaptureSummary> capture{};  ///< of a real robot
};
Summary summarise(const RunData& run);

std::string to_json(const Summary& summary, const RunInfo& info);

}  // namespace twocone::runs

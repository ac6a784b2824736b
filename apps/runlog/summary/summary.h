// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/estimation/estimator.h"
#include "apps/runlog/run_data.h"

namespace twocone::runlog {

/// Statistics of absolute errors: of distances in metres, of angles in radians. No error is left out.
struct ErrorStatistics {
  int count = 0;
  double mean = 0;
  double rmse = 0;
  double p95 = 0;  ///< 95 % of the errors are at most this (nearest rank)
  double max = 0;
};
/// Returns nothing if there are no errors.
std::optional<ErrorStatistics> statistics(std::vector<double> errors);

/// Comparison with the Cramer-Rao bound (apps/runlog/summary/bounds.h) over the frames that have an answer and a bound.
/// The unit is in the name of the field that holds the comparison.
struct BoundComparison {
  int count = 0;
  double bound_rms = 0;        ///< > 0
  std::optional<double> rmse;  ///< of the errors of the same frames; none without truth
  [[nodiscard]] std::optional<double> ratio() const { return rmse ? std::optional(*rmse / bound_rms) : std::nullopt; }
};

/// The number of answers for which a statement is true.
struct Share {
  int held = 0;
  int count = 0;  ///< answers with a sigma and a truth, > 0
};

/// Number of standard deviations that contains 95 % of a normal distribution.
constexpr double k95Sigmas = 1.959964;
/// The 95 % quantile of chi-squared with two degrees of freedom, -2 ln 0.05.
constexpr double k95Ellipse = 5.991465;

struct LandmarkSummary {
  std::string name;
  std::map<std::string, int> verdicts;   ///< frames by verdict
  std::optional<ErrorStatistics> error;  ///< |range - true range| of the frames with a range; none without truth
  std::optional<double> mean_true_range_m;
  int frames_with_range = 0;
  int outliers = 0;  ///< frames in which the fix rejected its measurement
  std::optional<BoundComparison> range_bound_m{};
  std::optional<Share> within_95{};  ///< ranges whose error is within k95Sigmas of their sigma
};

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

/// The numbers of the printed table (summary.json).
struct Summary {
  std::string method;
  int frames = 0;
  double duration_s = 0;
  std::vector<LandmarkSummary> landmarks;
  std::map<std::string, int> fix_verdicts;   ///< frames by verdict
  int frames_with_fix = 0;                   ///< frames with a position: ok, gap or ambiguous
  std::optional<ErrorStatistics> fix_error;  ///< the worse position of an ambiguous frame; none without truth
  std::optional<ErrorStatistics> odometry_error;
  std::optional<double> travelled_m;              ///< length of the true path
  std::optional<double> headings_covered_deg;     ///< out of 360, in bins of 10 degrees, of the true heading
  std::optional<ErrorStatistics> heading_error;   ///< of fixes with a heading; the worse one of an ambiguous frame
  std::optional<ErrorStatistics> estimate_error;  ///< of estimate.tum, for the frames that it contains
  std::optional<ErrorStatistics> estimate_heading_error;
  std::map<std::string, int>
      track_states{};  ///< frames by state of the track; empty for an older run and without a filter
  std::map<std::string, int> track_uses{};          ///< frames by the use of their fix (localisation::FixUse)
  std::optional<BoundComparison> position_bound_m;  ///< distance, sqrt(var x + var y)
  std::optional<BoundComparison> heading_bound_rad;
  /// Likewise with FrameBound::whole_covariance. Only given where it differs from the bound of the pixels: where map or
  /// rig is uncertain.
  std::optional<BoundComparison> whole_position_bound_m{};
  std::optional<BoundComparison> whole_heading_bound_rad{};
  /// Fixes whose own 95 % ellipse contains the true position; one of the two is enough for an ambiguous frame. A `weak`
  /// fix has no ellipse. A covariance that is not positive definite contains nothing.
  std::optional<Share> in_ellipse_95;
  std::optional<CaptureSummary> capture{};  ///< of a real robot
};
Summary summarise(const RunData& run);

std::string to_json(const Summary& summary, const RunInfo& info);

// ---- the table timing.csv

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

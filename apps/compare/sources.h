// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "apps/compare/both_runs.h"
#include "apps/compare/comparison.h"
#include "apps/compare/pictures.h"

namespace twocone::compare {

/// What a source's numbers may differ by though nothing was changed, beyond the sigma that the data state: what another
/// path, other pixels and a renderer's edges do. Standard deviations, of the difference of two runs.
struct ModelSigmas {
  double centre_px = 0.03;
  double rim_px = 0.05;
  double tilt_rad = 1e-4;
  double azimuth_rad = 3e-4;
  double apex_rad = 2e-4;
  double offset_m = 2e-4;
  double length_m = 1e-4;
  double log_gain = 0.005;
  double vignetting = 0.02;
  double blur_px = 0.05;
  double rate_share = 0.002;
  double landmark_m = 0.002;
};

/// Every possible cause of a gap that both runs' data can be asked about, tested by itself: chi-squared of real less
/// simulated under both covariances against `false_alarm` over the number of sources that can be told (Bonferroni), so
/// that of comparisons without a difference at most that share names any. Of the numbers of one robot some are bound to
/// each other by a drive's data: Source::confusable names those with a correlation beyond kConfusable.
/// @param level set to the level of each source
std::vector<Source> find_sources(const BothRuns& runs, const Pictures& pictures, double false_alarm, double& level);
constexpr double kConfusable = 0.9;

}  // namespace twocone::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "apps/compare/comparison.h"
#include "apps/compare/images.h"
#include "apps/compare/matching.h"

namespace twocone::compare {

/// Differences of a source's numbers that occur although nothing was changed, in addition to the sigma that the data
/// state: effects of another path, of other pixels and of a renderer's edges. Standard deviations, for the difference
/// of two runs.
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

/// Tests every possible cause of a gap that both runs' data can decide. Each test is chi-squared of real minus
/// simulated under both covariances, at the level `false_alarm` over the number of sources that can be decided
/// (Bonferroni). So at most the share `false_alarm` of comparisons without a difference name any source. The data of
/// one drive correlate some numbers of a robot: Source::confusable names those with a correlation beyond kConfusable.
/// @param level set to the level of each source
std::vector<Source> find_sources(const BothRuns& runs, const Images& images, double false_alarm, double& level);
constexpr double kConfusable = 0.9;

}  // namespace twocone::compare

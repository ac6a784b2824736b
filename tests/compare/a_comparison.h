// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "apps/compare/comparison.h"

namespace twocone::compare {

/// Returns an invented comparison: two sources differ, one agrees, one is not determined; names contain characters that
/// HTML must escape.
inline Comparison a_comparison() {
  Comparison c;
  c.simulated = "runs/<sim> & \"co\"";
  c.real = "runs/it's real";
  c.reference = "given trajectory";
  c.notes = {"The last frame of runs/<sim> is half-written & was left out."};
  c.simulated_frames = 300, c.real_frames = 294;
  c.matched_by_time = 280, c.matched_by_pose = 291;

  Row rim{Stage::kImage, "lower rim, radius", "px", 214.02, 216.01, 1.99, 0.08, "rim_px", 1.0, Light::kAmber, ""};
  Row noise{Stage::kImage, "noise <of a pixel>", "grey", 0.6, 4.1, 3.5, 0.05, "noise_grey", 1.0, Light::kRed, ""};
  Row fix{Stage::kFix, "position", "mm", 0.4, 0.9, 0.5, {}, "fix_mm", 5.0, Light::kGreen, ""};
  Row skew{Stage::kTiming, "age", "ms", {}, {}, {}, {}, "", {}, Light::kNone, "no clock is common to both"};
  c.rows = {rim, noise, fix, skew};

  Source small{.cause = Cause::kNoise, .view = vision::Side::kUpper, .verdict = SourceVerdict::kDiffers};
  small.components = {{"upper.noise_grey", "grey", 0.6, 4.1, 0.05}};
  small.chi_squared = 4900, small.p_value = 0;
  small.shares = {{Quantity::kRange, 0.12}};
  Source large{.cause = Cause::kFocalLength, .view = vision::Side::kLower, .verdict = SourceVerdict::kDiffers};
  large.components = {{"lower.rim_radius_px", "px", 214, 216, 0.1}};
  large.chi_squared = 400, large.p_value = 5.5e-89;
  large.shares = {{Quantity::kRange, 0.71}, {Quantity::kOdometry, -0.02}};
  large.confusable = {"lower tilt"};
  Source equal{.cause = Cause::kExposureAndColour, .view = vision::Side::kLower, .verdict = SourceVerdict::kAgrees};
  equal.components = {{"lower.gain", "1", 1, 1.004, 0.006}};
  equal.chi_squared = 0.44, equal.p_value = 0.51;
  Source undetermined{.cause = Cause::kRollingShutter};
  undetermined.reason = "the robot never turned fast enough";
  c.sources = {small, equal, large, undetermined};
  c.level = c.false_alarm / 3;
  c.gaps = {{Quantity::kRange, "mm", 9.2, 1.1, 0.9, 0.03}, {Quantity::kOdometry, "mm/m", 20.5, 4.0, 3.1, std::nullopt}};

  c.map.bounds = {-2, 2, -1.5, 1.5};
  c.map.landmarks = {{"<red>", {0.9, 0.1, 0.1}, 1.2, 0.7, 0.05, 0.4}, {"green", {0.1, 0.8, 0.1}, -1.2, 0.6, 0.05, 0.4}};
  for (int i = 0; i < 40; ++i) {
    const double t_s = i / 15.0, x_m = 0.02 * i;
    c.simulated_path.push_back({t_s, x_m, 0.1 * std::sin(3 * x_m), 0.1});
    c.real_path.push_back({t_s, x_m, 0.1 * std::sin(3 * x_m) + 0.004, 0.1});
    c.real_odometry.push_back({t_s, x_m * 1.02, 0.1 * std::sin(3 * x_m), 0.1});
    for (const std::size_t landmark : {0U, 1U}) {
      const double range_m = 1 + 0.3 * double(landmark) + 0.5 * x_m;
      const double wobble_m = 0.001 * std::sin(7.0 * i);
      c.simulated_residuals.push_back({t_s, landmark, range_m, wobble_m, std::nullopt});
      c.real_residuals.push_back({t_s, landmark, range_m, wobble_m + 0.008 * range_m, wobble_m});
    }
  }
  return c;
}

}  // namespace twocone::compare

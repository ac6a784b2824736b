// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "vision/triangulation.h"

/// Computes the textbook's range from the disparity alone, with which triangulate() is compared.
namespace twocone::vision {

/// Range of two upright 90 degree views from their radial disparity. It is given as its inverse, which stays
/// well-behaved out to infinity: 1 / (range + d) = disparity / (v s) (Burbridge & Spacek 2006, equation 1, inverted).
struct InverseRange {
  RangeVerdict verdict = RangeVerdict::kBeyondLimit;
  double inverse_per_m = 0;        ///< 1 / (range + d), signed: noise may take it below zero
  double sigma_inverse_per_m = 0;  ///< sigma_disparity / (v s), exact at every range
  std::optional<double> range_m;   ///< > 0; given only where the verdict is kOk
  std::optional<double> sigma_range_m;
};

struct DisparityGeometry {
  double focal_length_px = 0;      ///< v, > 0
  double mirror_separation_m = 0;  ///< s, > 0
  double lens_to_tip_m = 0;        ///< d, > 0
  double rim_radius_px = 0;        ///< r_m, > 0: no disparity exceeds it
};

/// Computes the range from a disparity. The verdict is kBeyondLimit where the disparity is not significant (below
/// kMinSigmas of its sigma: zero, negative noise, 1e-9 px). It is kImpossible where the disparity exceeds the rim's
/// radius, is not finite, or would give a range that is not > 0 or not finite. Otherwise it is kOk. Where the disparity
/// is above that radius, or it or its inverse is not finite, the inverse and its sigma are 0 and have no meaning.
/// @throws std::invalid_argument naming the fields outside their domain; sigma_px must be > 0
InverseRange range_from_disparity(double disparity_px, double sigma_px, const DisparityGeometry& geometry);

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <Eigen/Core>

#include "localisation/fix.h"

namespace twocone::localisation {

/// A horizontal distance from the robot's axis to a landmark's axis at a known place of the world.
struct LandmarkRange {
  Eigen::Vector2d landmark_m;
  double range_m = 0;  ///< >= 0; 0 is data: the robot stands on the landmark
};

/// Method `paper`: the position as in section 3.3 of Burbridge & Spacek 2006, kept as the baseline.
///
/// The three nearest landmarks' circles meet pairwise; of each pair's two meeting points the one nearer to the third
/// circle is a corner of the inner triangle, and the triangle's centre is the position.
///
/// Settled where the paper leaves it open:
/// * "Centre" is the centroid of the corners.
/// * Nearest means smallest range; of equal ranges the one that stands earlier.
/// * Two circles that do not meet give as their corner the middle of the gap on the line of their centres: verdict
/// kGap.
/// * Two circles with one centre have no such line and give no corner; the centre is then that of the others.
/// * When both meeting points of a pair lie equally near the third circle, to rounding, and apart (landmarks in line,
/// or two in
///   one place), nothing can choose: both answers, verdict kAmbiguous.
/// * A range that is negative or not finite is no measurement: left out and counted in Fix::unusable.
///
/// Coordinates are taken relative to the first landmark, and a pair's height over the line of centres by Kahan's form
/// of Heron's formula, so that neither a far origin nor near-tangent circles lose digits that the data hold. Near
/// tangency the problem itself is of condition 1/sqrt: an error e in a range moves the corner by up to sqrt(2 e r).
Fix fix_by_triangle(std::span<const LandmarkRange> ranges);

}  // namespace twocone::localisation

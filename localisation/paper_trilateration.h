// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <Eigen/Core>

#include "localisation/fix.h"

namespace twocone::localisation {

/// A horizontal distance from the robot's axis to a landmark's axis at a known place in the world.
struct LandmarkRange {
  Eigen::Vector2d landmark_m;
  double range_m = 0;  ///< >= 0; 0 is valid: the robot is at the landmark's place
};

/// Computes the position as in section 3.3 of Burbridge & Spacek 2006: method `paper`, kept as the baseline.
///
/// The circles of the three nearest landmarks intersect pairwise. Of each pair's two intersections, the one nearer to
/// the third circle is a corner of the inner triangle, and the triangle's centre is the position.
///
/// Decisions where the paper leaves a choice:
/// * "Centre" is the centroid of the corners.
/// * Nearest means smallest range; of equal ranges, the one that is earlier in the list.
/// * For two circles that do not intersect, the corner is the middle of the gap on the line of their centres: verdict
///   kGap.
/// * Two circles with one centre have no such line and give no corner; the centre is then that of the other corners.
/// * Where both intersections of a pair are equally near to the third circle, to rounding, and apart (landmarks in
///   line, or two at one place), there is no criterion: both answers are given, verdict kAmbiguous.
/// * A range that is negative or not finite is invalid: it is left out and counted in Fix::unusable.
///
/// Coordinates are relative to the first landmark, so a far origin costs no digits of the data. A pair's height over
/// the line of centres is computed by Kahan's form of Heron's formula, so near-tangent circles cost none either. Near
/// tangency the problem itself has a condition of 1/sqrt: an error e in a range moves the corner by up to sqrt(2 e r).
Fix fix_by_triangle(std::span<const LandmarkRange> ranges);

}  // namespace twocone::localisation

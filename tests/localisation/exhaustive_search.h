// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "localisation/least_squares_fix.h"

namespace twocone::localisation {

/// A local minimum of chi-squared.
struct FoundMinimum {
  double x_m;
  double y_m;
  double heading_rad;
  double chi_squared;
};

/// Chi-squared of uncorrelated measurements at a pose, written from its definition and without the library.
double chi_squared_at(const std::vector<LandmarkMeasurement>& measurements, double x_m, double y_m, double heading_rad);

/// Every local minimum that an exhaustive search finds, the lowest first. The starts are on a grid of places and
/// headings over the room and round it, and close together along each circle of a range and near each landmark. Each is
/// refined by Levenberg and Marquardt, then by Newton. A result is dropped if its slope is not zero or its curvature is
/// not positive, and so is a place within `kOnLandmark_m` of a landmark whose bearing was measured. Requires a range.
std::vector<FoundMinimum> find_all_minima(const std::vector<LandmarkMeasurement>& measurements);

/// The slope over the root of the curvature, in sigmas: the distance of a state from the minimum of the local parabola.
/// Negative where the curvature is not positive.
double sigmas_from_minimum(const std::vector<LandmarkMeasurement>& measurements, const FoundMinimum& at);

/// A direction to a landmark has no meaning nearer than this. It is a tenth of a millimetre, since landmarks are
/// thicker.
constexpr double kOnLandmark_m = 1e-4;

}  // namespace twocone::localisation

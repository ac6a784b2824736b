// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <boost/container/static_vector.hpp>

#include "localisation/least_squares/problem.h"

namespace twocone::localisation::least_squares {

/// Start states. At least one of them is near each minimum that could be the answer.
struct Starts {
  boost::container::static_vector<State, 40> states;
  bool is_one_valley = false;  ///< all are on a circle that is not observed along: the first that converges suffices

  void add(const State& s) {
    const bool is_number = std::isfinite(s.x) && std::isfinite(s.y) && std::isfinite(s.heading_rad);
    if (is_number && states.size() < states.capacity()) states.push_back(s);
  }
};

/// The weighted least-squares rigid motion from the landmarks with range and bearing, as points of the body frame, to
/// the map (Horn 1987, in the plane as complex numbers: m -> l by the argument of sum w conj(m) l).
struct Alignment {
  State state;
  /// |sum w conj(m) l|, w = 1 / (sigma_range^2 + range^2 sigma_bearing^2). A pose turned by an angle t against this one
  /// has a chi-squared of at least 2 strength (1 - cos t): where strength is large there is one minimum only.
  double strength = 0;
};
/// Requires at least one landmark with range and bearing.
Alignment align(const Problem& problem);

/// The place with the heading that follows from the bearings there: the weighted mean of
/// (direction to the landmark - bearing), as vectors; 0 without bearings.
State with_heading(const Problem& problem, double x, double y);

/// Adds starts for problems that the alignment does not determine:
/// * Two or more ranges: the squared ranges are linear in the position and its square. Along the landmarks' main axis
///   this gives one coordinate; across it, it gives the linear answer, and both roots of the square, which are mirror
///   images.
/// * Three or more bearings: cross(bearing, R^T l + t) = 0 is linear in (cos, sin, t); the null vector is found by
///   eigenvectors.
/// The heading at a place is the mean of the headings that follow from the bearings there.
void add_starts(const Problem& problem, Starts& starts);

}  // namespace twocone::localisation::least_squares

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <vector>

#include <boost/container/static_vector.hpp>

#include "localisation/least_squares/problem.h"

/// Finds start states for every minimum that matters: in closed form, and by searching the plane.
namespace twocone::localisation::least_squares {

/// Start states. At least one of them is near each minimum that could be the answer.
struct Starts {
  boost::container::static_vector<State, 40> states;
  bool is_one_valley = false;  ///< all lie along a circle that is not observed: the first that converges is enough

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
  /// has a chi-squared of at least 2 strength (1 - cos t). So there is one minimum only where strength is large.
  double strength = 0;
};
/// Computes the alignment. Requires at least one landmark with range and bearing.
Alignment align(const Problem& problem);

/// Returns the place with the heading that follows from the bearings there: the weighted mean of
/// (direction to the landmark - bearing), as vectors; 0 without bearings.
State with_heading(const Problem& problem, double x, double y);

/// Adds starts for problems that the alignment does not determine:
/// * Two or more ranges: the squared ranges are linear in the position and its square. This gives one coordinate along
///   the landmarks' main axis. Across that axis, it gives the linear answer, and both roots of the square, which are
///   mirror images.
/// * Three or more bearings: cross(bearing, R^T l + t) = 0 is linear in (cos, sin, t); the null vector is found by
///   eigenvectors.
/// The heading at a place is the mean of the headings that follow from the bearings there.
void add_starts(const Problem& problem, Starts& starts);

/// A small part of the plane in which chi-squared may be below the limit, and the best heading at its middle.
struct Cell {
  State middle;
  double reach = 0;       ///< distance from the middle to its farthest place
  double cost = 0;        ///< chi-squared at the middle
  bool is_small = false;  ///< false only if halving ended early
  bool is_fine = false;   ///< no whitened residual changes within it by more than kCellSigmas
};

/// Returns the places where chi-squared can be below `limit`: cells of some two sigmas that cover all such places, the
/// lowest first.
///
/// It is a branch and bound about the landmark with the most accurate range: only the ring of sqrt(limit) sigmas round
/// it is searched, in cells of polar coordinates. Each cell has a lower bound of chi-squared: the errors of the ranges
/// and of the differences of two bearings at the middle, minus their greatest change within the cell. So no place below
/// the limit is missed, and no derivative is needed. A cell whose bound is above the limit is dropped. Other cells are
/// halved, down to a size within which no whitened residual changes by more than kCellSigmas.
///
/// If more than kMostCells are left (sigmas that differ by orders of magnitude leave long thin valleys), halving ends
/// early, and the cells are larger than that.
/// Requires a range and a bearing.
std::vector<Cell> cells_below(const Problem& problem, double limit);

constexpr double kCellSigmas = 2;
constexpr int kMostCells = 8192;

}  // namespace twocone::localisation::least_squares

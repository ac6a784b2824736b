// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "localisation/least_squares/problem.h"

namespace twocone::localisation::least_squares {

/// A small part of the plane in which chi-squared may be below the limit, and the best heading at its middle.
struct Cell {
  State middle;
  double reach = 0;       ///< distance of its farthest place from the middle
  double cost = 0;        ///< chi-squared at the middle
  bool is_small = false;  ///< false only where halving ended early
  bool is_fine = false;   ///< no whitened residual changes within it by more than kCellSigmas
};

/// Returns the places where chi-squared can be below `limit`: cells of some two sigmas that cover all such places, the
/// lowest first.
///
/// It is a branch and bound about the landmark with the most accurate range: only the ring of sqrt(limit) sigmas round
/// it is searched, in cells of polar coordinates. Each cell has a lower bound of chi-squared: the errors of the ranges
/// and of the differences of two bearings at the middle, minus their greatest change within the cell. So no place below
/// the limit is missed; no derivative is used. A cell whose bound is above the limit is dropped. Others are halved,
/// down to a size within which no whitened residual changes by more than kCellSigmas.
///
/// Where more than kMostCells are left (sigmas that differ by orders of magnitude leave long thin valleys), halving
/// ends early, and the cells are larger than that.
/// Requires a range and a bearing.
std::vector<Cell> cells_below(const Problem& problem, double limit);

constexpr double kCellSigmas = 2;
constexpr int kMostCells = 8192;

}  // namespace twocone::localisation::least_squares

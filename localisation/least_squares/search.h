// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "localisation/least_squares/problem.h"

namespace twocone::localisation::least_squares {

/// A small part of the plane in which chi-squared may be as low as was asked for, and the best heading at its middle.
struct Cell {
  State middle;
  double reach = 0;       ///< of its farthest place from the middle
  double cost = 0;        ///< chi-squared at the middle
  bool is_small = false;  ///< false only where halving ended early
  bool is_fine = false;   ///< no whitened number changes within it by more than kCellSigmas
};

/// Where chi-squared can be below `limit`: cells of some two sigmas that cover all such places, the lowest first.
///
/// Branch and bound about the landmark whose range is the surest: only the ring of sqrt(limit) sigmas round it is
/// searched, in cells of polar coordinates. For each cell there is a lower bound of chi-squared: what the ranges and
/// the differences of two bearings are off at the middle, less what they can change by within the cell. So nothing
/// below the limit is passed over; no derivative is used. A cell whose bound is above the limit is dropped, others are
/// halved, down to a size within which no whitened number changes by more than kCellSigmas.
///
/// Where more than kMostCells are left (sigmas that differ by orders of magnitude leave long thin valleys) halving
/// ends early, and the cells are larger than that.
/// Needs a range and a bearing.
std::vector<Cell> cells_below(const Problem& problem, double limit);

constexpr double kCellSigmas = 2;
constexpr int kMostCells = 8192;

}  // namespace twocone::localisation::least_squares

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "localisation/least_squares/answer.h"

namespace twocone::localisation::least_squares {

/// The answer after the wrong landmarks are left out.
struct Cleaned {
  std::vector<int> left_out;  ///< indices into Problem::landmarks, ascending
  Answer answer;              ///< of the others
};

/// Two against one cannot be decided: when two labels are exchanged, the two exchanged landmarks agree.
constexpr int kFewestBelieved = 3;
/// Up to this number of landmarks, every single one and every pair is left out in turn.
constexpr int kMostTriedInTurn = 8;

/// Solves an inconsistent problem without its wrong landmarks. Nothing where no set explains the others, or where
/// several sets do that give different places. Fewer are left out than believed, and kFewestBelieved or more are
/// believed.
///
/// Up to kMostTriedInTurn landmarks: leaves out each one, then each pair, and takes the smallest set without which the
/// others are consistent. If there is none, and with more landmarks, it uses consensus. Small samples (two landmarks
/// where all have range and bearing, else three), drawn in a fixed order that spreads evenly, each give a place. Places
/// are rated by the errors of the landmarks there, each counted up to the false-alarm limit only. The number of samples
/// is such that a sample without an outlier is missed with a probability of 1e-9, given the share of landmarks that
/// agree so far. From the best few places the landmarks that agree are fitted, and selected again by the forecast of
/// the fit, until the set does not change. The cost is linear in the landmarks.
std::optional<Cleaned> without_outliers(const Problem& problem);

}  // namespace twocone::localisation::least_squares

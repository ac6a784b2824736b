// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "localisation/least_squares/answer.h"

namespace twocone::localisation::least_squares {

/// What is left when the wrong ones are left out.
struct Cleaned {
  std::vector<int> left_out;  ///< places in Problem::landmarks, rising
  Answer answer;              ///< of the others
};

/// Two against one cannot be decided: with an exchange of two labels the two exchanged agree.
constexpr int kFewestBelieved = 3;
/// Up to so many landmarks every one and every pair of them is left out in turn.
constexpr int kMostTriedInTurn = 8;

/// The landmarks of an inconsistent problem without those that are wrong; nothing where no set explains the others, or
/// where several sets do that tell different places. Fewer are left out than believed, and kFewestBelieved or more are
/// believed.
///
/// Up to kMostTriedInTurn landmarks: each one, then each pair; the smallest set whose others are consistent. Where
/// there is none, and with more landmarks: by consensus. Small samples (two landmarks where all have range and bearing,
/// else three), drawn in a fixed order that spreads evenly, each give a place; places are weighed by what the landmarks
/// are off there, each counted up to the false-alarm limit only. So many samples are drawn that one without an outlier
/// is missed with a chance of 1e-9, by the share of landmarks that agree so far. From the best few places the landmarks
/// that agree are fitted, and taken again by what the fit forecasts, until the set stays. The cost is linear in the
/// landmarks.
std::optional<Cleaned> without_outliers(const Problem& problem);

}  // namespace twocone::localisation::least_squares

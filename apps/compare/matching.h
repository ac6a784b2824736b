// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/files/map_file.h"
#include "apps/runs/run_data.h"

namespace twocone::compare {

/// Why two maps cannot be of one room, for a message; empty: they can. Judged by the distances between landmarks of the
/// same name, so that another origin, a landmark that was moved, and one that is missing count for nothing.
std::string why_other_rooms(const files::Map& a, const files::Map& b);

/// Which frame of one run stands for which of the other.
struct Match {
  std::size_t simulated = 0, real = 0;  ///< indices into the two lists
};

/// Each of `real` with the one of `simulated` nearest in time, if within `most_apart_s`; a simulated one may serve
/// twice.
/// @param simulated,real times, rising
std::vector<Match> match_by_time(std::span<const double> simulated, std::span<const double> real, double most_apart_s);

/// How far two poses are apart as pictures go: a turn of a radian counts as a metre, which moves what is a metre away
/// so far.
double distance_m(const runs::PoseRow& a, const runs::PoseRow& b);

/// Each of `real` with the one of `simulated` at the least distance_m, if within `most_apart_m`. Poses that are not
/// known match nothing.
std::vector<Match> match_by_pose(std::span<const std::optional<runs::PoseRow>> simulated,
                                 std::span<const std::optional<runs::PoseRow>> real, double most_apart_m);

/// Straight between the two of `poses`, in the order of their times, around `t_s`; nothing before, after, and where
/// these are farther apart in time than `longest_gap_s`.
std::optional<runs::PoseRow> pose_at(std::span<const runs::PoseRow> poses, double t_s, double longest_gap_s = INFINITY);

}  // namespace twocone::compare

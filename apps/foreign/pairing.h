// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "apps/foreign/stamps.h"

namespace twocone::foreign {

/// Median time between neighbours; nothing for fewer than two. @param times rising
std::optional<Stamp> median_period(const std::vector<Stamp>& times);

/// A stereo frame: indices into the two cameras' pictures.
struct Pair {
  std::size_t lower = 0, upper = 0;
  friend bool operator==(const Pair&, const Pair&) = default;
};

/// Pictures of two cameras that belong together: the two that are nearest in time first, then the next nearest that
/// are left, and so on within `max_skew`. Each picture is in one pair at most, and in both cameras pairs follow one
/// another in time.
/// @param lower,upper rising @param max_skew >= 0, at most a period
std::vector<Pair> pair_pictures(const std::vector<Stamp>& lower, const std::vector<Stamp>& upper, Stamp max_skew);

/// For each of `used`, rising indices into `times`: exposures since the one before it that are in no frame. These are
/// the pictures between them, and where stamps are k periods apart, to the nearest whole number, k - 1 that were never
/// stored. For the first: the pictures before it.
std::vector<std::uint64_t> lost_before(const std::vector<Stamp>& times, const std::vector<std::size_t>& used);

}  // namespace twocone::foreign

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "apps/import/stamps.h"

namespace twocone::importer {

/// Returns the median time between neighbours, or nothing for fewer than two times. @param times increasing
std::optional<Stamp> median_period(const std::vector<Stamp>& times);

/// A stereo frame: indices into the two cameras' images.
struct Pair {
  std::size_t lower = 0, upper = 0;
  friend bool operator==(const Pair&, const Pair&) = default;
};

/// Pairs the images of two cameras. The two images that are nearest in time form the first pair, then the nearest of
/// those that remain, and so on within `max_skew`. Each image is in one pair at most, and the pairs have the same order
/// in both cameras.
/// @param lower,upper increasing
/// @param max_skew >= 0, at most a period
std::vector<Pair> pair_images(const std::vector<Stamp>& lower, const std::vector<Stamp>& upper, Stamp max_skew);

/// Returns, for each of `used`, the number of exposures since the previous one that are in no frame. `used` has
/// increasing indices into `times`. The number counts the images between them. Where stamps are k periods apart,
/// rounded to the nearest whole number, it also counts k - 1 exposures that were never stored. For the first, it counts
/// the images before it.
std::vector<std::uint64_t> lost_before(const std::vector<Stamp>& times, const std::vector<std::size_t>& used);

}  // namespace twocone::importer

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace twocone::vision {

/// The logarithm of a radius in m, which is known with that variance; variance 0: it is not known.
struct LogRadius {
  double mean = 0;
  double variance = 0;
};

/// Returns what the other radii of a room say of one: their mean, with the variance between them (DerSimonian and Laird
/// 1986), and one standard deviation of that variance, for differences that do not show. A room's landmarks are often
/// alike, and the images of a far one alone hardly tell its radius from its range. Returns nothing for fewer than two
/// known others. @param one index of that radius, known or not
std::optional<LogRadius> as_the_others(std::span<const LogRadius> radii, std::size_t one);

}  // namespace twocone::vision

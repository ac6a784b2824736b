// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "apps/runs/run_data.h"

namespace twocone::compare {

/// When a run's frames came, by their stamps.
struct Timing {
  double rate_hz = 0;   ///< over the median time between frames that follow each other without loss; 0: unknown
  double jitter_s = 0;  ///< standard deviation of those times
  double skew_s = 0;    ///< mean of the stamped time of the upper view less that of the lower one
  double skew_sigma_s = 0;
  double most_skew_s = 0;  ///< largest absolute
  /// Frames of lower and upper that were lost before or between those of the run, and all that there were.
  std::array<std::uint64_t, 2> lost{}, all{};
  /// How far the machine's clock fell behind the stamps while the run went on: pictures that came ever later. None
  /// where the stamps are simulated time.
  std::optional<double> ageing_s{};
};

/// @param run two frames or more
Timing timing_of(const runs::RunData& run);

/// How probable so many losses, or as improbable a number, are where each frame is lost with `probability`, in [0, 1]:
/// the exact binomial test, both sides.
double lost_p_value(std::uint64_t lost, std::uint64_t all, double probability);

/// How probable it is that two cameras of one and the same loss differ so much or more, both sides: Fisher's exact
/// test.
double lost_p_value(std::uint64_t lost_a, std::uint64_t all_a, std::uint64_t lost_b, std::uint64_t all_b);

}  // namespace twocone::compare

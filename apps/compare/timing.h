// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "apps/runlog/run_data.h"

namespace twocone::compare {

/// Times of a run's frames, from their stamps.
struct Timing {
  double rate_hz = 0;   ///< over the median time between consecutive frames without loss; 0: unknown
  double jitter_s = 0;  ///< standard deviation of those times
  double skew_s = 0;    ///< mean of the stamped time of the upper view minus that of the lower one
  double skew_sigma_s = 0;
  double most_skew_s = 0;  ///< largest absolute
  /// Frames of lower and upper that were lost before or between those of the run, and the number of all frames.
  std::array<std::uint64_t, 2> lost{}, all{};
  /// Growth of the delay between a stamp and the machine's clock over the run: images that came later and later. None
  /// where the stamps are simulated time.
  std::optional<double> ageing_s{};
};

/// @param run at least two frames
Timing timing_of(const runlog::RunData& run);

/// Returns the probability of this number of losses, or of one as improbable, where each frame is lost with
/// `probability`, in [0, 1]: the exact two-sided binomial test.
double lost_p_value(std::uint64_t lost, std::uint64_t all, double probability);

/// Returns the probability that two cameras with the same loss differ at least so much: Fisher's exact test, two-sided.
double lost_p_value(std::uint64_t lost_a, std::uint64_t all_a, std::uint64_t lost_b, std::uint64_t all_b);

}  // namespace twocone::compare

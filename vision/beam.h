// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace twocone::vision {

/// What a beam of a scan says. Without a range at its bearings it says nothing: unknown.
enum class BeamState : std::uint8_t { kUnknown, kFree, kOccupied };

/// A beam of a scan (scan.h): beam k of n is about the bearing -pi + 2 pi (k + 0.5) / n, body frame.
struct Beam {
  BeamState state = BeamState::kUnknown;
  /// Horizontal distance from the body's origin. Occupied: of the nearest thing. Free: of the farthest thing, or place
  /// of the floor, that is ranged there; nothing within the heights was ranged before it. Unknown: 0.
  double range_m = 0;
  double sigma_m = 0;  ///< occupied: of range_m; else 0
  double top_m = 0;    ///< occupied: the greatest height over the floor that was ranged of the thing; else 0
};

}  // namespace twocone::vision

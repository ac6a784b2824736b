// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>

namespace twocone::vision {

/// What a beam of a scan says. Without a range at its bearings it says nothing: unknown.
enum class BeamState : std::uint8_t { kUnknown, kFree, kOccupied };

/// A beam of a scan (scan.h).
struct Beam {
  BeamState state = BeamState::kUnknown;
  /// Horizontal distance from the body's origin. Occupied: of the nearest thing. Free: of the farthest thing, or place
  /// of the floor, that is ranged there; nothing within the heights was ranged before it. Unknown: 0.
  double range_m = 0;
  double sigma_m = 0;  ///< occupied: of range_m; else 0
  double top_m = 0;    ///< occupied: the greatest height over the floor that was ranged of the thing; else 0
  /// Where the floor was ranged, whatever is nearer or farther: the bits of all its distances.
  std::uint32_t floor = 0;
  static constexpr double kFloorStep_m = 0.1;
  /// Returns the bit of all distances within the same kFloorStep_m; 0 beyond the last one. @param distance_m >= 0
  static std::uint32_t floor_bit(double distance_m) {
    const double step = distance_m / kFloorStep_m;
    return step < 32 ? std::uint32_t{1} << static_cast<unsigned>(step) : 0;
  }
};

/// Returns the bearing of the middle of beam `k` of `beams` in the body's frame, -pi to pi.
inline double beam_bearing_rad(std::size_t k, std::size_t beams) {
  return -std::numbers::pi + 2 * std::numbers::pi / double(beams) * (double(k) + 0.5);
}

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>

#include "hal/diff_drive.h"

namespace twocone::estimation {

/// Returns the wheel angles at the time an image was taken. A frame arrives some time after its exposure, and the
/// wheels are read after it has arrived. At half a metre per second, a delay of 50 ms would place the frame 25 mm too
/// far ahead.
class WheelHistory {
 public:
  /// Adds a reading. Readings must be in time order and of one clock.
  void add(const WheelAngles& reading);
  /// Interpolates between the two readings around `time`, as if the wheels had turned at constant speed. Before the
  /// first and after the last reading, it returns that reading. Requires at least one reading.
  /// @throws std::invalid_argument for a time of another clock
  [[nodiscard]] WheelAngles at(Timestamp time) const;

 private:
  // Longer than the delay of any camera.
  static constexpr std::chrono::seconds kKept{5};
  std::deque<WheelAngles> readings_;
};

}  // namespace twocone::estimation

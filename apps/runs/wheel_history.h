// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>

#include "hal/diff_drive.h"

namespace twocone::runs {

/// Where the wheels stood when a picture was taken. A camera's frame comes some time after its exposure, and the wheels
/// are read when it has come: at half a metre a second, a frame that took 50 ms would be taken for one from 25 mm
/// farther on.
class WheelHistory {
 public:
  /// Readings in the order in which they were made, of one clock.
  void add(const WheelAngles& reading);
  /// Between the two readings around `time`, as if the wheels had turned evenly; before the first and after the last
  /// reading, that one. There must be a reading. @throws std::invalid_argument for a time of another clock
  [[nodiscard]] WheelAngles at(Timestamp time) const;

 private:
  // More than any camera's delay.
  static constexpr std::chrono::seconds kKept{5};
  std::deque<WheelAngles> readings_;
};

}  // namespace twocone::runs

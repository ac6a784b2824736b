// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/wheel_history.h"

#include <cassert>
#include <cmath>
#include <iterator>

namespace twocone::estimation {

void WheelHistory::add(const WheelAngles& reading) {
  readings_.push_back(reading);
  while (reading.time - readings_.front().time > kKept) readings_.pop_front();
}

WheelAngles WheelHistory::at(Timestamp time) const {
  assert(!readings_.empty());
  auto after = readings_.rbegin();  // queries are for recent times
  if ((time - after->time).count() >= 0) return *after;
  while (after != readings_.rend() && (time - after->time).count() < 0) ++after;
  if (after == readings_.rend()) return readings_.front();
  const WheelAngles& from = *after;
  const WheelAngles& to = *std::prev(after);
  const double share =
      std::chrono::duration<double>(time - from.time) / std::chrono::duration<double>(to.time - from.time);
  return {time, std::lerp(from.left_rad, to.left_rad, share), std::lerp(from.right_rad, to.right_rad, share)};
}

}  // namespace twocone::estimation

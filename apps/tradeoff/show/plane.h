// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/tradeoff/sweep.h"

/// What a picture of a sweep shows, and where on the paper. Private to apps/tradeoff.
namespace twocone::tradeoff {

/// What an error costs.
enum class Cost { kRobotTime, kSimulationTime };
Interval cost_s(const SettingResult& result, Cost cost);

/// A place in a picture, in its pixels from its upper left corner.
struct Pixel {
  double x = 0, y = 0;
};

/// A logarithmic axis and the pixels that it takes.
struct LogAxis {
  double low = 0, high = 0;  ///< in the axis's unit, 0 < low < high
  double low_px = 0, high_px = 0;
  [[nodiscard]] double px(double value) const;
  /// Value and label of each tic: 1, 2, 5 a decade, over many decades 1 alone.
  [[nodiscard]] std::vector<std::pair<double, std::string>> tics() const;
};

/// In the axes' units.
struct PlanePoint {
  double x = 0, y = 0;
};

/// A setting in the picture.
struct Mark {
  std::size_t setting = 0;  ///< index in Sweep::settings
  PlanePoint at;
  Interval x, y;
  bool on_frontier = false;
  bool answers_enough = false;
};

/// Error over cost: all of a sweep in one picture.
struct Plane {
  Cost cost = Cost::kRobotTime;
  int width_px = 0, height_px = 0;
  double unit_s = 1;  ///< of x; y is in millimetres
  LogAxis x, y;
  std::vector<Mark> marks;           ///< those on the frontier last, by rising cost
  std::vector<PlanePoint> frontier;  ///< by rising cost
  std::vector<PlanePoint> bound;     ///< the least bound that costs no more, by rising cost
  PlanePoint paper;                  ///< PaperPoint

  [[nodiscard]] Pixel pixel(PlanePoint point) const { return {x.px(point.x), y.px(point.y)}; }
};

/// Settings whose error or cost is not a positive number are left out.
Plane plane_of(const Sweep& sweep, Cost cost);

}  // namespace twocone::tradeoff

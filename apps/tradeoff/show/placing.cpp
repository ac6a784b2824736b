// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/show/placing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace twocone::tradeoff {
namespace {

double overlap(const Box& a, const Box& b) {
  const double width = std::min(a.right, b.right) - std::max(a.left, b.left);
  const double height = std::min(a.bottom, b.bottom) - std::max(a.top, b.top);
  return width > 0 && height > 0 ? width * height : 0;
}

bool is_inside(const Box& box, const Box& frame) {
  return box.left >= frame.left && box.right <= frame.right && box.top >= frame.top && box.bottom <= frame.bottom;
}

}  // namespace

void Placing::keep_clear(Box box, double weight) { kept_.push_back({box, weight}); }

void Placing::keep_clear(Pixel from, Pixel to, double weight) {
  constexpr double kStep_px = 4, kHalf_px = 1.5;
  const double length = std::hypot(to.x - from.x, to.y - from.y);
  const int steps = std::max(1, int(std::ceil(length / kStep_px)));
  for (int i = 0; i <= steps; ++i) {
    const double x = from.x + (to.x - from.x) * i / steps;
    const double y = from.y + (to.y - from.y) * i / steps;
    keep_clear({x - kHalf_px, y - kHalf_px, x + kHalf_px, y + kHalf_px}, weight);
  }
}

Pixel Placing::place(Pixel point, double width, double height) {
  // Directions in degrees, y downward. The area below and to the left of a frontier is empty.
  constexpr std::array<double, 16> kDirections{135, 157.5, 112.5, 180, 90, 202.5, 67.5,  225,
                                               45,  247.5, 22.5,  270, 0,  292.5, 337.5, 315};
  constexpr double kPenaltyPerPixel = 0.6, kPenaltyPerTurn = 0.05;
  double least = std::numeric_limits<double>::infinity();
  Box best{point.x - width / 2, point.y - height / 2, point.x + width / 2, point.y + height / 2};
  for (const double gap : {7.0, 11.0, 16.0, 22.0, 30.0, 40.0, 52.0}) {
    double turn = 0;
    for (const double degrees : kDirections) {
      const double angle = degrees * std::numbers::pi / 180;
      const double x = point.x + std::cos(angle) * (gap + width / 2);
      const double y = point.y + std::sin(angle) * (gap + height / 2);
      const Box box{x - width / 2, y - height / 2, x + width / 2, y + height / 2};
      turn += kPenaltyPerTurn;
      if (!is_inside(box, frame_)) continue;
      double penalty = gap * kPenaltyPerPixel + turn;
      for (const Kept& kept : kept_) penalty += kept.weight * overlap(box, kept.box);
      if (penalty < least) {
        least = penalty;
        best = box;
      }
    }
  }
  kept_.push_back({best, 5});
  return {(best.left + best.right) / 2, (best.top + best.bottom) / 2};
}

}  // namespace twocone::tradeoff

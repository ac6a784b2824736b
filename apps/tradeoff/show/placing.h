// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "apps/tradeoff/show/plane.h"

/// Words in a picture where they hide nothing. Private to apps/tradeoff.
namespace twocone::tradeoff {

/// A rectangle, in pixels.
struct Box {
  double left = 0, top = 0, right = 0, bottom = 0;
};

/// Keeps what is drawn already, and finds room beside a point.
class Placing {
 public:
  /// Nothing is put outside `frame`.
  explicit Placing(Box frame) : frame_(frame) {}

  /// `weight`: how bad it is to be covered.
  void keep_clear(Box box, double weight);
  /// A line, as boxes along it.
  void keep_clear(Pixel from, Pixel to, double weight);

  /// The middle of the best place for `width` by `height` pixels beside `point`; it is kept clear from then on. Of two
  /// that hide as little the nearer, of equal ones the one below and to the left.
  Pixel place(Pixel point, double width, double height);

 private:
  struct Kept {
    Box box;
    double weight;
  };
  Box frame_;
  std::vector<Kept> kept_;
};

}  // namespace twocone::tradeoff

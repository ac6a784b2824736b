// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "apps/tradeoff/show/plane.h"

/// Places words in an image where they cover nothing. Private to apps/tradeoff.
namespace twocone::tradeoff {

/// A rectangle, in pixels.
struct Box {
  double left = 0, top = 0, right = 0, bottom = 0;
};

/// Records the areas that are drawn already, and finds free space beside a point.
class Placing {
 public:
  /// Nothing is put outside `frame`.
  explicit Placing(Box frame) : frame_(frame) {}

  /// @param weight penalty for covering this area
  void keep_clear(Box box, double weight);
  /// Records a line, as boxes along it.
  void keep_clear(Pixel from, Pixel to, double weight);

  /// Returns the middle of the best place for `width` by `height` pixels beside `point`, and records that place as
  /// occupied. Of two places that cover equally little it takes the nearer one, of equally near ones the one below and
  /// to the left.
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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace twocone::vision {

/// The share of a pixel inside a straight edge, and its derivative by the edge's distance. It is exact for a square
/// pixel where `wide` and `narrow` are the larger and the smaller of |x| and |y| of the edge's normal, times the
/// pixel's width.
struct Coverage {
  double value, slope;
};
inline Coverage coverage(double inside_px, double wide, double narrow) {
  const double half = (wide + narrow) / 2;
  const double distance = std::abs(inside_px);
  if (distance >= half) return {inside_px > 0 ? 1.0 : 0.0, 0.0};
  if (distance <= (wide - narrow) / 2) return {0.5 + inside_px / wide, 1 / wide};
  const double corner = half - distance;
  const double area = corner * corner / (2 * wide * narrow);
  return {inside_px > 0 ? 1 - area : area, corner / (wide * narrow)};
}

}  // namespace twocone::vision

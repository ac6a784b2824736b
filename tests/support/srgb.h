// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace twocone::testing_support {

/// The sRGB code, not rounded, of linear light (IEC 61966-2-1). It is written apart from the product's conversion,
/// which tests check against it.
inline double coded(double linear) {
  return 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055);
}

}  // namespace twocone::testing_support

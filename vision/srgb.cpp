// SPDX-License-Identifier: Apache-2.0
#include "vision/srgb.h"

#include <cmath>

namespace twocone::vision {

double srgb_to_linear(double code) {
  const double coded = code / 255;
  return coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4);
}

}  // namespace twocone::vision

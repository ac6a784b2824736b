// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace twocone::vision {

/// Linear light, 0 to 1, of an sRGB code, 0 to 255, which need not be an integer (IEC 61966-2-1).
double srgb_to_linear(double code);

}  // namespace twocone::vision

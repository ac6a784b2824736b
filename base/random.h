// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>

namespace twocone::base {

/// Returns a random number in [0, 1), of 53 random bits. It replaces the distributions of the standard library, because
/// these differ between implementations, and no result may depend on the implementation.
inline double fraction(std::mt19937_64& random) { return double(random() >> 11U) * 0x1p-53; }

}  // namespace twocone::base

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace twocone::testing_support {

inline constexpr double kEps = std::numeric_limits<double>::epsilon();
inline constexpr double kInf = std::numeric_limits<double>::infinity();
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace twocone::testing_support

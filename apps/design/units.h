// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

/// Units that people read, for messages and tables. Private to this folder.
namespace twocone::design {

constexpr double kDegree = std::numbers::pi / 180;  ///< rad

inline double in_degrees(double angle_rad) { return angle_rad / kDegree; }
inline double in_mm(double length_m) { return 1000 * length_m; }

}  // namespace twocone::design

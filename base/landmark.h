// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>

namespace twocone {

/// An upright cylinder at a known place. World frame, metres.
struct Landmark {
  std::string name{};
  std::array<double, 3> colour{};  ///< linear rgb, each in [0, 1]; its hue identifies the landmark
  double x_m = 0;                  ///< of the axis
  double y_m = 0;
  double radius_m = 0;  ///< > 0
  double top_m = 0;     ///< height of the flat top above the floor, > 0
  /// Greatest distance of a robot from its axis, > radius_m, which limits how small the landmark can appear. Empty: it
  /// may be as small as the smallest object that method `outline` detects.
  std::optional<double> greatest_range_m{};

  friend bool operator==(const Landmark&, const Landmark&) = default;
};

}  // namespace twocone

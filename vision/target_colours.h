// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vision/ranging.h"

namespace twocone::vision {

/// Returns the targets' colours in their order, as HueLabels and ColourTable take them.
inline std::vector<Eigen::Vector3d> colours_of(const std::vector<Target>& targets) {
  std::vector<Eigen::Vector3d> colours;
  colours.reserve(targets.size());
  for (const Target& target : targets) colours.push_back(target.colour);
  return colours;
}

}  // namespace twocone::vision

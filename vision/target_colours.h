// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vision/ranging.h"

namespace twocone::vision {

/// Returns the targets' colours in their order, as HueLabels and ColourTable take them.
inline std::vector<Eigen::Vector3d> colours_of(const std::vector<Landmark>& targets) {
  std::vector<Eigen::Vector3d> colours;
  colours.reserve(targets.size());
  for (const Landmark& target : targets) colours.emplace_back(target.colour.data());
  return colours;
}

}  // namespace twocone::vision

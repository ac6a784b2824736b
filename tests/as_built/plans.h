// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "apps/as_built/as_built.h"

namespace twocone::as_built {

/// A shipped robot with its map.
struct Plan {
  config::Robot robot;
  config::Map map;

  explicit Plan(const std::string& room)
      : robot(config::read_robot(std::filesystem::path(TWOCONE_SOURCE_DIR) / "robots" / (room + "_sim.yaml"))),
        map(config::read_map(robot.map)) {}

  [[nodiscard]] AsBuilt drawn(std::uint64_t seed, const Tolerances& tolerances = {},
                              const std::optional<Unmodelled>& unmodelled = {}) const {
    return draw(robot, map, seed, tolerances, unmodelled);
  }
};

constexpr const char* kRooms[] = {"lab", "hall", "workshop"};

}  // namespace twocone::as_built

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/design/sight.h"

namespace twocone::design {

/// A rig with what it can do.
struct Result {
  config::Robot robot;
  std::optional<config::Map> map;
  AnalysisSettings settings;
  Analysis analysis;
};

/// Returns design.json: the rig's measures, what both mirrors see where, with sigmas, sensitivities and the room.
/// Lengths are in metres, angles in radians. null: there is none.
nlohmann::ordered_json design_json(const Result& result);
/// Returns index.html, the viewer with design.json.
std::string page(const Result& result);
/// Returns the text for the terminal, at most 120 columns.
std::string table(const Result& result);

}  // namespace twocone::design

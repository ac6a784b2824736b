// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "apps/calibrate/calibrate.h"

/// What the JSON files of solutions share: STEM.calibration.json and STEM.survey.json.
namespace twocone::calibrate {

/// Returns program, robot and runs, and how well the solution agrees with what was seen.
nlohmann::ordered_json solution_json(const Report& report);

/// Returns the numbers that are believed after the calibration with their joint covariance, as config::Calibration.
nlohmann::ordered_json belief_json(const Report& report);

}  // namespace twocone::calibrate

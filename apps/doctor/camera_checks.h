// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/doctor/report.h"
#include "apps/doctor/stream.h"
#include "apps/doctor/surroundings.h"
#include "drivers/backends.h"
#include "hal/camera.h"
#include "vision/rim.h"

namespace twocone::doctor {

struct CameraUnderTest {
  std::string name;  ///< as after `cameras:`
  drivers::CameraPart asked;
  std::optional<vision::RimCircle> rim{};  ///< where `rig:` says that the mirror's is; none: a camera without mirror
};

/// What was measured and what to do, without the part.
Row judge_format(const drivers::CameraPart& asked, const CameraFacts& applied);
/// One row for each control that was asked for.
std::vector<Row> judge_controls(const std::vector<std::pair<std::string, double>>& asked,
                                const std::vector<std::pair<std::string, double>>& applied);
/// Rate, jitter, lost frames and age. @param stream with frames
std::vector<Row> judge_stream(const Footage& stream, const CameraSettings& asked);

/// Configures the camera, streams for `seconds` and looks at what came; leaves it stopped.
/// @throws Interrupted, likewise
void check_camera(const CameraUnderTest& test, Camera& camera, double seconds, const Surroundings& surroundings,
                  Report& report);

}  // namespace twocone::doctor

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
  std::optional<vision::RimCircle> rim{};  ///< rim of the mirror according to `rig:`; none: a camera without mirror
};

/// Returns the measurement and the advice; the caller sets the part.
Row judge_format(const drivers::CameraPart& asked, const CameraFacts& applied);
/// Returns a row for each control that the robot file sets.
std::vector<Row> judge_controls(const std::vector<std::pair<std::string, double>>& asked,
                                const std::vector<std::pair<std::string, double>>& applied);
/// Returns rate, jitter, lost frames and age. @param stream with frames
std::vector<Row> judge_stream(const Footage& stream, const CameraSettings& asked);

/// Configures the camera, streams for `seconds` and checks the frames; leaves the camera stopped.
/// @throws Interrupted; the camera is stopped then, too
void check_camera(const CameraUnderTest& test, Camera& camera, double seconds, const Surroundings& surroundings,
                  Report& report);

}  // namespace twocone::doctor

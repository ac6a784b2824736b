// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/calibrate/calibrate.h"
#include "apps/estimation/self_rig.h"

/// The start of a calibration: what the images of a run show before anything is believed.
namespace twocone::calibrate {

/// The robot with which the sightings start, and what the images showed.
struct Start {
  config::Robot robot;
  std::optional<vision::SelfRig> found;
  std::vector<estimation::RigDifference> replaced;
  bool exchanged = false;
  vision::CalibrationPriors priors;
};

/// Looks for the rig in some thirty images of a run, in pairs that are a short drive apart. Images that cannot be read
/// are left out. Errors: kBadData, with what to change, where a camera gives nothing, and where the robot file leaves
/// numbers to the images and these do not show them.
Result<Start> find_start(const runlog::RunData& run, const config::Robot& robot, const Settings& settings);

/// Returns the size of a camera's images.
inline cv::Size size_of(const drivers::CameraPart& camera) {
  return {camera.settings.width_px, camera.settings.height_px};
}

}  // namespace twocone::calibrate

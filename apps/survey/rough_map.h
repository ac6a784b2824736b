// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/calibrate/calibrate.h"
#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "apps/runlog/run_data.h"
#include "base/plane.h"
#include "hal/result.h"

/// The start of a survey: landmarks and poses, to some centimetres, from a drive without a map.
namespace twocone::survey {

/// What was found in the frames that a survey uses. The world is that of the first run's start pose.
struct RoughMap {
  std::vector<Landmark> landmarks;                    ///< named by hue and number: red.1
  std::vector<std::optional<Eigen::Vector3d>> poses;  ///< of the chosen frames: x m, y m, heading rad
  Pose2 first;                        ///< at the time of the first chosen frame, by the wheels alone since the start
  BodyTwist twist;                    ///< at that time
  std::vector<std::string> left_out;  ///< what was seen and is no landmark, a sentence each
};

/// Returns how wrong rig and wheels may be, whatever the map's landmarks are.
config::BeliefErrors errors_without_landmarks(const config::Robot& robot, config::Map map);

/// Finds landmarks by their bands and vivid colours, by bands alone where there are vision::kBandsAlone of them
/// (vision/landmark_search.h), and tracks them and the pose from frame to frame
/// (localisation/map_filter.h). Each run starts a map of its own; those of later runs are laid onto the first by the
/// landmarks that both have. The landmarks of the runs' maps are not used.
/// Errors: kBadData where images or wheels are missing, where fewer than two landmarks are found, and where a run does
/// not show enough of the landmarks of the first.
Result<RoughMap> find_rough_map(const std::vector<runlog::RunData>& runs, const calibrate::ChosenFrames& chosen,
                                const config::Robot& robot);

}  // namespace twocone::survey

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <future>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "apps/config/robot_file.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/scene_views.h"
#include "hal/image.h"
#include "hal/result.h"

namespace twocone::runs {

/// From here on a start that is not where the scene shows the robot is worth a word: a fix of an ideal room errs by
/// half a millimetre and a tenth of a degree, one of a robot as first built by 15 mm and a degree.
constexpr double kStartWarning_m = 0.020;
constexpr double kStartWarning_deg = 2.0;

/// Compares the robot file's start with where the scene shows the lower camera, which rides on the robot's axis; its
/// image's x axis is rig.lower.azimuth_rad off the heading.
/// @param place of the key `start`, for messages: "robots/lab_sim.yaml:17"
/// @returns a warning with both places; nothing below the limits above.
/// Errors: kRefused: they are farther apart than body.radius_m: every fix would be off by as much.
Result<std::optional<std::string>> compare_start(const config::Robot& robot, const sim_povray::ShownCamera& lower,
                                                 const std::string& place);

/// The same for a simulated robot, asked of POV-Ray in the background while the first images are rendered.
class StartCheck {
 public:
  StartCheck(const config::Robot& robot, const sim_povray::PlaceSettings& place, const std::string& robot_name,
             std::string start_place);
  /// Waits for POV-Ray's answer. A warning, also where the places could not be compared; nothing: they agree.
  /// Errors: as compare_start(); kCancelled once `stop` is set. Once only.
  Result<std::optional<std::string>> wait(const std::atomic<bool>& stop);

 private:
  const config::Robot& robot_;
  std::string start_place_;
  std::future<Result<sim_povray::ShownCamera>> shown_;
  std::jthread asker_;
};

/// A sentence for each mirror that a pair of images does not show where the robot file's `rig:` says, to a pixel, or
/// whose rim does not stand out in them.
std::vector<std::string> rim_warnings(const config::Robot& robot, const Image& lower, const Image& upper);

}  // namespace twocone::runs

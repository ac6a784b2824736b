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

/// Differences between the start and the robot's place in the scene that cause a warning. A fix in an ideal room has an
/// error of half a millimetre and a tenth of a degree, and one of a robot as first built has 15 mm and a degree.
constexpr double kStartWarning_m = 0.020;
constexpr double kStartWarning_deg = 2.0;

/// Compares the robot file's start with the place of the lower camera in the scene. The camera is on the robot's axis.
/// The bearing of its image's x axis from the heading is rig.lower.azimuth_rad.
/// @param place of the key `start`, for messages: "robots/lab_sim.yaml:17"
/// @returns a warning with both places, or nothing below the limits above.
/// Errors: kRefused: they are farther apart than body.radius_m. Every fix would have this error.
Result<std::optional<std::string>> compare_start(const config::Robot& robot, const sim_povray::ShownCamera& lower,
                                                 const std::string& place);

/// Makes the same check for a simulated robot. POV-Ray reports the camera's place in the background while the first
/// images are rendered.
class StartCheck {
 public:
  StartCheck(const config::Robot& robot, const sim_povray::PlaceSettings& place, const std::string& robot_name,
             std::string start_place);
  /// Waits for POV-Ray's answer. Returns a warning if the places differ or could not be compared, or else nothing.
  /// May be called once. Errors: as compare_start(); kCancelled once `stop` is set.
  Result<std::optional<std::string>> wait(const std::atomic<bool>& stop);

 private:
  const config::Robot& robot_;
  std::string start_place_;
  std::future<Result<sim_povray::ShownCamera>> shown_;
  std::jthread asker_;
};

constexpr double kRimWarning_px = 1;

/// Returns a sentence for each mirror whose rim in the image differs by more than `limit_px` from the robot file's
/// `rig:`, or whose rim cannot be found there.
std::vector<std::string> rim_warnings(const config::Robot& robot, const Image& lower, const Image& upper,
                                      double limit_px = kRimWarning_px);

}  // namespace twocone::runs

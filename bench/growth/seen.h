// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "apps/config/robot_file.h"
#include "base/plane.h"
#include "drivers/sim_povray/simulation_host.h"

namespace twocone::bench {

struct Seen {
  std::vector<cv::Mat> images;  ///< lower, upper; CV_8UC3, r g b
  double render_ms = 0;         ///< the renderer's processor time for both
};

/// Returns the stereo frame of time 0 at a pose. @throws std::runtime_error for any failure
Seen seen_at(sim_povray::SimulationHost& host, sim_povray::SessionSettings session, const config::Robot& robot,
             const Pose2& pose);

}  // namespace twocone::bench

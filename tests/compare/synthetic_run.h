// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <Eigen/Core>

#include "tests/support/temporary_folder.h"

namespace twocone::compare {

/// A drive among the lab's pillars, in pictures that are made without POV-Ray (tests/support/synthetic_lab.h).
struct SyntheticDrive {
  std::string driver = "sim_povray";  ///< as the robot file says; any other is a real robot
  int frames = 12;
  double rate_hz = 5;
  int width_px = 320, height_px = 240;
  /// The pictures' lower mirror stands so far from where the robot believes it.
  Eigen::Vector2d lower_centre_off_px = Eigen::Vector2d::Zero();
  double gain = 1;
  double noise_grey = 1;
  unsigned seed = 1;
};

/// Makes a run folder of it in `folder`, with truth, wheels and the answers of method full.
std::filesystem::path make_run(const testing_support::TemporaryFolder& folder, const std::string& name,
                               const SyntheticDrive& drive);

}  // namespace twocone::compare

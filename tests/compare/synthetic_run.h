// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <Eigen/Core>

#include "tests/support/temporary_folder.h"

namespace twocone::compare {

/// A drive among the lab's landmarks, in images that are made without POV-Ray (tests/support/synthetic_lab.h).
struct SyntheticDrive {
  std::string driver = "sim_povray";  ///< as in the robot file; any other driver is a real robot
  int frames = 12;
  double rate_hz = 5;
  int width_px = 320, height_px = 240;
  /// Offset of the lower mirror in the images from the robot's belief.
  Eigen::Vector2d lower_centre_off_px = Eigen::Vector2d::Zero();
  double gain = 1;
  double noise_grey = 1;
  unsigned seed = 1;
};

/// Writes a run folder of the drive into `folder`, with truth, wheels and the answers of method outline.
std::filesystem::path make_run(const testing_support::TemporaryFolder& folder, const std::string& name,
                               const SyntheticDrive& drive);

}  // namespace twocone::compare

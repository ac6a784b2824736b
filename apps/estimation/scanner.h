// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "hal/image.h"
#include "vision/beam.h"
#include "vision/dense_ranging.h"

namespace twocone::estimation {

/// Returns what ranges everything in the robot's images. @throws config::FileError for a rig that vision rejects
vision::DenseRanging dense_ranging(const config::Robot& robot, const config::Map& map);

/// Scans what is around the robot, by full range images. Those of half the azimuths and one round, which take a third
/// of the time (vision::DenseSettings), miss thin things as the edge of a table top.
class Scanner {
 public:
  /// @throws as dense_ranging()
  Scanner(const config::Robot& robot, const config::Map& map);

  /// @param lower,upper of the robot's cameras, of one time. An image that cannot be used gives unknown beams.
  [[nodiscard]] std::vector<vision::Beam> scan(const Image& lower, const Image& upper) const;
  /// Returns the same for images of the robot file's sizes, 8-bit RGB.
  [[nodiscard]] std::vector<vision::Beam> scan(const cv::Mat& lower, const cv::Mat& upper) const;

 private:
  cv::Size size_;
  vision::DenseRanging ranging_;
};

}  // namespace twocone::estimation

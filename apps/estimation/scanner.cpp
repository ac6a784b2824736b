// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/scanner.h"

#include "apps/config/to_layers.h"
#include "apps/estimation/image_as_mat.h"
#include "vision/scan.h"

namespace twocone::estimation {

vision::DenseRanging dense_ranging(const config::Robot& robot, const config::Map& map) {
  return {vision::UncertainRig(config::to_rig(robot), config::to_belief_errors(robot, map).vision.rig),
          {robot.lower.settings.width_px, robot.lower.settings.height_px}};
}

Scanner::Scanner(const config::Robot& robot, const config::Map& map)
    : size_(robot.lower.settings.width_px, robot.lower.settings.height_px), ranging_(dense_ranging(robot, map)) {}

std::vector<vision::Beam> Scanner::scan(const Image& lower, const Image& upper) const {
  Image lower_rgb;
  Image upper_rgb;
  const auto lower_pixels = as_rgb(lower, size_, "lower", lower_rgb);
  const auto upper_pixels = as_rgb(upper, size_, "upper", upper_rgb);
  if (!lower_pixels || !upper_pixels) return std::vector<vision::Beam>(vision::ScanSettings{}.beams);
  return scan(*lower_pixels, *upper_pixels);
}

std::vector<vision::Beam> Scanner::scan(const cv::Mat& lower, const cv::Mat& upper) const {
  return scan_of(ranging_.measure(lower, upper), vision::ScanSettings{});
}

}  // namespace twocone::estimation

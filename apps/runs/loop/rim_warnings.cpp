// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/rim_warnings.h"

#include <cmath>
#include <tuple>

#include <fmt/format.h>

#include "apps/estimation/image_as_mat.h"
#include "vision/rim.h"

namespace twocone::runs {
namespace {

constexpr double kRimWarning_px = 1;

}  // namespace

std::vector<std::string> rim_warnings(const config::Robot& robot, const Image& lower, const Image& upper) {
  std::vector<std::string> warnings;
  for (const auto& [view, image, rig] :
       {std::tuple{"lower", &lower, &robot.rig.lower}, {"upper", &upper, &robot.rig.upper}}) {
    const auto rgb = to_rgb8(*image);
    if (!rgb) continue;
    const cv::Mat pixels = estimation::as_mat(*rgb);
    const Eigen::Vector2d centre(rig->centre_px[0], rig->centre_px[1]);
    const auto rim = vision::find_rim(pixels, {centre, rig->rim_radius_px, 0});
    if (!rim && !vision::rim_may_show(pixels, {centre, rig->rim_radius_px, 0})) {
      warnings.push_back(fmt::format(
          "note: the {0} mirror's rim does not stand out in the first image: rig.{0} was not compared with it", view));
    } else if (!rim) {
      warnings.push_back(fmt::format(
          "warning: no mirror rim was found in the first {} image near the one that rig.{} states", view, view));
    } else if (std::abs(rim->radius_px - rig->rim_radius_px) > kRimWarning_px ||
               (rim->centre_px - centre).norm() > kRimWarning_px) {
      warnings.push_back(fmt::format(
          "warning: the {} mirror's rim is seen at centre ({:.1f}, {:.1f}) px with radius {:.1f} px, but rig.{} says "
          "({:.1f}, {:.1f}) and {:.1f}: ranges will be wrong; correct the robot file",
          view, rim->centre_px.x(), rim->centre_px.y(), rim->radius_px, view, centre.x(), centre.y(),
          rig->rim_radius_px));
    }
  }
  return warnings;
}

}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "apps/doctor/checks/checks.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/estimation/self_rig.h"
#include "apps/runlog/storage/image_file.h"

namespace twocone::doctor {
namespace {

constexpr const char* kRigPart = "rig";
const std::string kNames[] = {"lower", "upper"};

using vision::NotFound;

/// Draws with the accuracy of a sixteenth of a pixel.
constexpr int kShift = 4;
cv::Point shifted(const Eigen::Vector2d& place_px) {
  return {static_cast<int>(std::lround(place_px.x() * (1 << kShift))),
          static_cast<int>(std::lround(place_px.y() * (1 << kShift)))};
}

void draw_circle(cv::Mat& rgb, const Eigen::Vector2d& centre_px, double radius_px, const cv::Scalar& colour) {
  cv::circle(rgb, shifted(centre_px), static_cast<int>(std::lround(radius_px * (1 << kShift))), colour, 1, cv::LINE_AA,
             kShift);
}

void draw_cross(cv::Mat& rgb, const Eigen::Vector2d& place_px, const cv::Scalar& colour) {
  constexpr double kArm_px = 9;
  for (const Eigen::Vector2d& arm : {Eigen::Vector2d(kArm_px, 0), Eigen::Vector2d(0, kArm_px)}) {
    cv::line(rgb, shifted(place_px - arm), shifted(place_px + arm), colour, 1, cv::LINE_AA, kShift);
  }
}

/// Returns an image with the file's circle red, the one that was found green, with a cross on the tip.
Image drawn(const cv::Mat& rgb, const vision::RimCircle& believed, const vision::SelfView& view) {
  const cv::Scalar red(255, 40, 40);
  const cv::Scalar green(60, 230, 60);
  cv::Mat canvas = rgb.clone();
  draw_circle(canvas, believed.centre_px, believed.radius_px, red);
  draw_cross(canvas, believed.centre_px, red);
  if (view.mirror.rim) {
    draw_circle(canvas, view.mirror.rim->centre_px, view.mirror.rim->radius_px, green);
    draw_cross(canvas, view.mirror.tip ? view.mirror.tip->centre_px : view.mirror.rim->centre_px, green);
  }
  return estimation::as_image(canvas);
}

void store(const RigUnderTest& test, const vision::SelfRig& found, Report& report) {
  if (test.images.empty()) return;
  std::string names;
  try {
    runlog::make_folder(test.images);
    for (const std::size_t i : {0, 1}) {
      const config::RigView& view = i == 0 ? test.robot.rig.lower : test.robot.rig.upper;
      const Image image = drawn(i == 0 ? test.lower_rgb : test.upper_rgb,
                                {{view.centre_px[0], view.centre_px[1]}, view.rim_radius_px, 0}, found.views[i]);
      const auto file = test.images / (kNames[i] + ".png");
      runlog::write_image(file, image);
      names += (names.empty() ? "" : ", ") + file.string();
    }
  } catch (const runlog::DiskError& error) {
    report.add({kRigPart, "images", error.what(), kWarning, "name another folder with --images"});
    return;
  }
  report.add({kRigPart, "images", names + ": green what was found, red what rig: states"});
}

Row judge_cameras(const vision::SelfRig& found) {
  Row row{kRigPart, "cameras", "each camera looks into its own mirror"};
  if (found.shows_one_mirror) {
    row.measured = "both cameras show the same mirror";
    row.judge(kFailed, estimation::what_to_change(found));
  } else if (!found.exchanged.value) {
    row.measured = fmt::format("not known which mirror each camera shows ({})", to_string(found.exchanged.reason));
    row.judge(kNotRun, estimation::what_to_change(found));
  } else if (*found.exchanged.value) {
    row.measured = "exchanged: camera lower shows the upper mirror, and camera upper the lower one";
    row.judge(kFailed, "exchange the entries of cameras.lower and cameras.upper, or the plugs");
  }
  return row;
}

Row judge_mirrored(const vision::SelfView& view, const std::string& name, bool in_file) {
  Row row{kRigPart, fmt::format("mirrored {}", name), ""};
  if (!view.mirrored.value) {
    row.measured = fmt::format("not known ({}); {} landmarks seen", to_string(view.mirrored.reason), view.landmarks);
    row.judge(kNotRun, "put the robot where both cameras see four landmarks of its map, then repeat");
    return row;
  }
  row.measured = fmt::format("the image is {}mirrored, rig: says {}mirrored", *view.mirrored.value ? "" : "not ",
                             in_file ? "" : "not ");
  if (*view.mirrored.value != in_file) {
    row.judge(kFailed, fmt::format("rig: {}: {{mirrored: {}}}, or change the camera's flip setting", name,
                                   *view.mirrored.value));
  }
  return row;
}

Row judge_azimuth(const vision::SelfRig& found, const config::Rig& rig) {
  Row row{kRigPart, "azimuth", ""};
  const auto degrees = [](double rad) { return rad * 180 / std::numbers::pi; };
  if (!found.relative_azimuth.rad) {
    row.measured = fmt::format("not known ({})", to_string(found.relative_azimuth.reason));
    row.judge(kNotRun, estimation::what_to_change(found));
    return row;
  }
  const double in_file_rad = base::wrap_angle_rad(rig.upper.azimuth_rad - rig.lower.azimuth_rad);
  const double off_rad = base::wrap_angle_rad(*found.relative_azimuth.rad - in_file_rad);
  row.measured =
      fmt::format("upper minus lower {:.1f} +- {:.1f} degrees, rig: says {:.1f}", degrees(*found.relative_azimuth.rad),
                  degrees(found.relative_azimuth.sigma_rad), degrees(in_file_rad));
  const double limit_rad =
      std::max(estimation::kSameAzimuth_rad, estimation::kSameSigmas * found.relative_azimuth.sigma_rad);
  if (std::abs(off_rad) > limit_rad) {
    row.judge(kFailed, fmt::format("a camera is turned: rig: upper: {{azimuth_rad: {:.3f}}}, then twocone calibrate",
                                   base::wrap_angle_rad(rig.upper.azimuth_rad + off_rad)));
  }
  return row;
}

}  // namespace

void check_rig(const RigUnderTest& test, Report& report) {
  vision::SelfRigProblem problem = estimation::self_rig_problem(test.robot, test.map);
  problem.frames.push_back({test.lower_rgb, test.upper_rgb, {}, {}});
  const vision::SelfRig found = vision::find_rig(problem);
  if (test.map.landmarks.size() < vision::kLeastRigLandmarks) return store(test, found, report);
  if (found.views[0].is_blind() || found.views[1].is_blind()) {
    // Exposure and mirror have rows of their own.
    report.add({kRigPart, "cameras",
                fmt::format("not known: {} and {} landmarks seen", found.views[0].landmarks, found.views[1].landmarks),
                kNotRun, estimation::what_to_change(found)});
  } else {
    report.add(judge_cameras(found));
    if (!found.shows_one_mirror && !found.exchanged.value.value_or(false)) {
      report.add(judge_mirrored(found.views[0], kNames[0], test.robot.rig.lower.mirrored));
      report.add(judge_mirrored(found.views[1], kNames[1], test.robot.rig.upper.mirrored));
      report.add(judge_azimuth(found, test.robot.rig));
    }
  }
  store(test, found, report);
}

}  // namespace twocone::doctor

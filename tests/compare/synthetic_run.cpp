// SPDX-License-Identifier: Apache-2.0
#include "tests/compare/synthetic_run.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include <fmt/format.h>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "apps/import/motion.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "apps/runs/run.h"
#include "tests/support/synthetic_view.h"

namespace twocone::compare {
namespace {

using testing_support::SyntheticLandmark;
using testing_support::SyntheticView;

std::string robot_text(const SyntheticDrive& drive) {
  const std::string camera = fmt::format("{{driver: {}, width_px: {}, height_px: {}, rate_hz: {}}}", drive.driver,
                                         drive.width_px, drive.height_px, drive.rate_hz);
  const std::string view =
      fmt::format("{{centre_px: [{}, {}], rim_radius_px: {}, azimuth_rad: 0}}", (drive.width_px - 1) / 2.0,
                  (drive.height_px - 1) / 2.0, drive.height_px / 2.0 - 2);
  return fmt::format(
      "name: synthetic\n"
      "map: {}/scenes/lab.map.yaml\n"
      "start: {{x_m: 0, y_m: 0, heading_rad: 0}}\n"
      "body: {{radius_m: 0.2}}\n"
      "drive: {{driver: {}, wheel_separation_m: 0.30, wheel_radius_m: 0.05, max_speed_mps: 0.5, sigma: 0}}\n"
      "cameras:\n  lower: {}\n  upper: {}\n"
      "rig:\n  mirror: {{type: cone, apex_rad: 1.5707963267948966}}\n"
      "  mirror_radius_m: 0.06\n  lens_to_tip_m: 0.12\n  mirror_separation_m: 0.30\n  lens_height_m: 0.25\n  sigma: 0\n"
      "  lower: {}\n  upper: {}\n",
      TWOCONE_SOURCE_DIR, drive.driver, camera, camera, view, view);
}

Image image_of(const cv::Mat& image) {
  return {image.cols, image.rows, PixelFormat::kRgb8, {image.datastart, image.dataend}};
}

/// An S-shaped drive, so that radius, separation and offsets can be distinguished.
std::vector<localisation::Pose> poses_of(const SyntheticDrive& drive) {
  constexpr double kSpeed_mps = 0.4;
  std::vector<localisation::Pose> poses{{-0.6, -0.3, 0.4}};
  while (poses.size() < std::size_t(drive.frames)) {
    const double t_s = double(poses.size()) / drive.rate_hz;
    const double turn_rad = 0.8 * std::sin(2.5 * t_s) / drive.rate_hz, way_m = kSpeed_mps / drive.rate_hz;
    const localisation::Pose& last = poses.back();
    const double along_rad = last.heading_rad + turn_rad / 2;
    poses.push_back(
        {last.x_m + way_m * std::cos(along_rad), last.y_m + way_m * std::sin(along_rad), last.heading_rad + turn_rad});
  }
  return poses;
}

}  // namespace

std::filesystem::path make_run(const testing_support::TemporaryFolder& folder, const std::string& name,
                               const SyntheticDrive& drive) {
  const config::Robot robot = config::read_robot(folder.write(name + ".yaml", robot_text(drive)));
  const config::Map map = config::read_map(robot.map);
  std::vector<SyntheticLandmark> landmarks;
  for (const config::Landmark& l : map.landmarks) {
    landmarks.push_back({{l.x_m, l.y_m}, l.radius_m, l.top_m, {l.colour[0], l.colour[1], l.colour[2]}});
  }
  const vision::Rig rig = config::to_rig(robot);
  vision::MirrorViewSettings lower = rig.lower.settings();
  lower.centre_px += drive.lower_centre_off_px;
  const cv::Size size(drive.width_px, drive.height_px);
  const testing_support::SyntheticBackground background{.level = 0.4, .swing = 0.2};
  const SyntheticView lower_view(vision::MirrorView(lower), size, background);
  const SyntheticView upper_view(rig.upper, size, background);

  const std::filesystem::path to = folder.path() / name;
  const auto poses = poses_of(drive);
  const auto wheels = importer::wheels_of(poses, config::to_wheels(robot));
  {
    runlog::RunFolder run(to);
    std::mt19937_64 random(drive.seed);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const localisation::Pose& pose = poses[i];
      const testing_support::SyntheticScene scene{
          testing_support::seen_from(landmarks, {pose.x_m, pose.y_m}, pose.heading_rad), {}, {}};
      const testing_support::SyntheticCamera camera{drive.gain, drive.noise_grey};
      runlog::FrameRecord record;
      const double t_s = double(i) / drive.rate_hz;
      record.frame.frame = i;
      record.frame.t_s = record.frame.lower_t_s = record.frame.upper_t_s = t_s;
      record.frame.lower_sequence = record.frame.upper_sequence = i;
      record.drive = {t_s, {}, {}, wheels.turns[i].left_rad, wheels.turns[i].right_rad};
      record.odometry = {t_s, pose.x_m, pose.y_m, pose.heading_rad};
      record.truth = record.odometry;
      const cv::Mat below = lower_view.image(scene, camera, random);
      const cv::Mat above = upper_view.image(scene, camera, random);
      run.add(record, image_of(below), image_of(above));
    }
  }
  runlog::RunInfo info;
  info.behaviour = "wander";
  info.method = "outline";
  info.finished = true;
  runlog::write_run_yaml(to, info, robot, robot.map);
  const auto localised = runs::localise(to, estimation::Method::kOutline, [](double) {});
  if (!localised) throw std::runtime_error(localised.error().message);
  return to;
}

}  // namespace twocone::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Dense>
#include <opencv2/imgproc.hpp>

#include "apps/config/to_layers.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/summary/bounds.h"
#include "tests/support/lab_robot.h"
#include "tests/support/temporary_folder.h"
#include "vision/ranging.h"

namespace twocone::report {

using ScratchFolder = testing_support::TemporaryFolder;

/// A plausible run: a smooth wander among six landmarks, ranges and fixes with noise and drop-outs, odometry that
/// drifts, images drawn by the mirrors' own formula. It needs no rendering and no vision, so that only the report is
/// under test.
inline config::Robot synthetic_robot() {
  config::Robot robot = testing_support::with_images(testing_support::lab_robot(), 320, 240, 116);
  robot.file = "robots/lab_sim.yaml";
  robot.name = "lab";
  robot.map = "scenes/lab.map.yaml";
  return robot;
}

inline config::Map synthetic_map() {
  config::Map map;
  map.file = "scenes/lab.map.yaml";
  map.unit_m = 0.05;
  map.bounds = {-3.05, 3.05, -2.55, 2.55};
  map.landmarks = {{"red", {1, 0, 0}, -2.5, -2.0, 0.075, 0.9},    {"green", {0, 1, 0}, 0.1, -2.2, 0.075, 0.9},
                   {"blue", {0, 0, 1}, 2.6, -1.9, 0.075, 0.9},    {"cyan", {0, 1, 1}, 2.5, 2.0, 0.075, 0.9},
                   {"magenta", {1, 0, 1}, -0.2, 2.2, 0.075, 0.9}, {"yellow", {1, 1, 0}, -2.6, 1.9, 0.075, 0.9}};
  map.obstacles = {config::Polygon{{-1.0, 1.9}, {-0.4, 1.9}, {-0.4, 2.5}, {-1.0, 2.5}}, Disc{{2.3, 0.2}, 0.25}};
  return map;
}

/// The true pose at `t_s`: loops of changing curvature about the middle.
inline runlog::PoseRow synthetic_pose(double t_s) {
  const double w = 0.31;
  const double dx = 1.3 * w * std::cos(w * t_s) - 0.25 * 2.7 * w * std::sin(2.7 * w * t_s);
  const double dy = -1.0 * w * std::sin(w * t_s + 0.4) + 0.2 * 1.9 * w * std::cos(1.9 * w * t_s);
  return {t_s, 1.3 * std::sin(w * t_s) + 0.25 * std::cos(2.7 * w * t_s),
          1.0 * std::cos(w * t_s + 0.4) + 0.2 * std::sin(1.9 * w * t_s), std::atan2(dy, dx)};
}

inline double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

inline runlog::RangeRow synthetic_range(const runlog::RunData& run, const runlog::FrameRow& frame,
                                        const config::Landmark& landmark, std::mt19937_64& random) {
  const runlog::PoseRow pose = synthetic_pose(frame.t_s);
  const double true_m = std::hypot(landmark.x_m - pose.x_m, landmark.y_m - pose.y_m);
  const double bearing = wrapped(std::atan2(landmark.y_m - pose.y_m, landmark.x_m - pose.x_m) - pose.heading_rad);
  runlog::RangeRow row{frame.frame, frame.t_s, landmark.name, "ok", {}, {}, {}, {}, {}, {}};
  row.true_range_m = true_m;
  row.bearing_rad = bearing;
  const config::RigView& view = run.robot.rig.lower;
  const double vs =
      (view.lens_to_tip_m / view.mirror_radius_m + 1) * view.rim_radius_px * run.robot.rig.mirror_separation_m;
  const double disparity = vs / (true_m + view.lens_to_tip_m) + std::uniform_real_distribution<>(-0.5, 0.5)(random);
  const double luck = std::uniform_real_distribution<>(0, 1)(random);
  if (true_m < 1.55) {
    row.verdict = "truncated";
  } else if (luck < 0.02) {
    row.verdict = "no_match";
  } else if (frame.frame % 97 < 9 && landmark.name == run.map.landmarks.back().name) {
    row.verdict = "not_seen";
    row.bearing_rad.reset();
  } else {
    row.disparity_px = disparity;
    row.range_m = vs / disparity - view.lens_to_tip_m;
  }
  return row;
}

/// Draws a mirror's image: a grey room, each landmark from its foot's side of the tip to its top.
inline cv::Mat synthetic_image(const runlog::RunData& run, const vision::MirrorView& view,
                               const runlog::PoseRow& pose) {
  cv::Mat image(run.robot.lower.settings.height_px, run.robot.lower.settings.width_px, CV_8UC3, cv::Scalar::all(20));
  const auto& s = view.settings();
  const cv::Point centre(cvRound(s.centre_px.x()), cvRound(s.centre_px.y()));
  cv::circle(image, centre, static_cast<int>(s.rim_radius_px), cv::Scalar(160, 155, 150), cv::FILLED, cv::LINE_AA);
  for (const config::Landmark& landmark : run.map.landmarks) {
    const double range = std::hypot(landmark.x_m - pose.x_m, landmark.y_m - pose.y_m);
    const double bearing = std::atan2(landmark.y_m - pose.y_m, landmark.x_m - pose.x_m) - pose.heading_rad;
    const double half_width = std::asin(std::min(1.0, landmark.radius_m / range));
    const double top = view.image_radius_px(range - landmark.radius_m, landmark.top_m).value_or(s.rim_radius_px);
    std::vector<cv::Point> corners;
    for (const auto& [side, radius] : {std::pair{-1, 3.0}, {-1, top}, {0, top}, {1, top}, {1, 3.0}}) {
      const Eigen::Vector2d p = s.centre_px + view.offset_px(bearing + side * half_width, radius);
      corners.emplace_back(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
    }
    const auto& c = landmark.colour;
    cv::fillPoly(image, std::vector<std::vector<cv::Point>>{corners}, cv::Scalar(255 * c[0], 255 * c[1], 255 * c[2]));
  }
  return image;
}

/// @param image_step every such frame gets images; 0: none
inline runlog::RunData synthetic_run(const std::filesystem::path& folder, int frames, int image_step = 0,
                                     config::Map map = synthetic_map()) {
  runlog::RunData run;
  run.folder = folder;
  run.info = {.version = "0.1.0",
              .commit = "3f2c1ab",
              .compiler = "GNU 12.2.0",
              .behaviour = "wander",
              .method = "paper",
              .seed = 7,
              .frames_wanted = frames,
              .effects = {},
              .finished = true,
              .wall_s = 61.5,
              .render_wait_s = 48.25,
              .own_cpu_s = 9.5,
              .render_cpu_s = 104.0,
              .events = {}};
  run.method = "paper";
  run.robot = synthetic_robot();
  run.map = std::move(map);
  std::mt19937_64 random(20061);
  std::normal_distribution<> noise(0, 0.018);
  double drift_x = 0, drift_y = 0;
  for (int i = 0; i < frames; ++i) {
    runlog::FrameRow frame;
    frame.frame = static_cast<std::uint64_t>(i);
    frame.t_s = frame.lower_t_s = frame.upper_t_s = i / 15.0;
    run.frames.push_back(frame);
    const runlog::PoseRow pose = synthetic_pose(frame.t_s);
    run.truth.push_back(pose);
    drift_x += 0.00035 * std::cos(0.01 * i);
    drift_y += 0.00025;
    run.odometry.push_back({frame.t_s, pose.x_m + drift_x, pose.y_m + drift_y, pose.heading_rad});
    int usable = 0;
    for (const config::Landmark& landmark : run.map.landmarks) {
      run.ranges.push_back(synthetic_range(run, frame, landmark, random));
      usable += run.ranges.back().range_m ? 1 : 0;
    }
    runlog::FixRow fix;
    fix.frame = frame.frame;
    fix.t_s = frame.t_s;
    fix.true_x_m = pose.x_m;
    fix.true_y_m = pose.y_m;
    fix.verdict = usable < 3 || i % 61 == 60 ? "too_few" : i % 23 == 22 ? "gap" : "ok";
    if (fix.verdict != "too_few") {
      fix.x_m = pose.x_m + noise(random);
      fix.y_m = pose.y_m + noise(random);
      fix.error_m = std::hypot(*fix.x_m - pose.x_m, *fix.y_m - pose.y_m);
    }
    run.fixes.push_back(fix);
  }
  if (image_step > 0) {
    const vision::Rig rig = config::to_rig(run.robot);
    for (const auto& [file_of, view] :
         {std::pair{&runlog::lower_image_file, &rig.lower}, {&runlog::upper_image_file, &rig.upper}}) {
      std::filesystem::create_directories(file_of(folder, 0).parent_path());
      for (std::size_t i = 0; i < run.frames.size(); i += static_cast<std::size_t>(image_step)) {
        runlog::write_image(file_of(folder, run.frames[i].frame),
                            estimation::as_image(synthetic_image(run, *view, run.truth[i])));
      }
    }
  }
  return run;
}

/// Returns the run as method `outline` would measure it: sightings whose outlines have this noise, and ranges and fixes
/// whose errors and stated sigmas are those of the Cramer-Rao bound.
inline runlog::RunData outline_run(runlog::RunData run, double edge_noise_px = 0.08) {
  run.method = "outline";
  const vision::Rig rig = config::to_rig(run.robot);
  const auto truth = runlog::at_frames(run, run.truth);
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const Eigen::Rotation2Dd R_BW(-truth[i]->heading_rad);
    for (const config::Landmark& landmark : run.map.landmarks) {
      const Eigen::Vector2d p_BL_m = R_BW * Eigen::Vector2d(landmark.x_m - truth[i]->x_m, landmark.y_m - truth[i]->y_m);
      for (const auto& [name, view] : {std::pair{"lower", &rig.lower}, {"upper", &rig.upper}}) {
        const auto near_m = vision::near_top_point(*view, p_BL_m, landmark.radius_m, landmark.top_m);
        const auto pixel = near_m ? view->project(*near_m) : std::nullopt;
        if (!pixel) continue;
        run.sightings.push_back({run.frames[i].frame, run.frames[i].t_s, landmark.name, name, pixel->x(), pixel->y(),
                                 1e-3, 0, 1e-3, edge_noise_px});
      }
    }
  }
  std::map<std::uint64_t, runlog::FrameBound> bounds;
  for (const runlog::FrameBound& bound : runlog::bounds(run)) bounds[bound.frame] = bound;
  std::mt19937_64 random(31);
  std::normal_distribution<> normal;
  for (std::size_t i = 0; i < run.ranges.size(); ++i) {
    runlog::RangeRow& row = run.ranges[i];
    const auto& bound = bounds.at(row.frame).landmarks[i % run.map.landmarks.size()];
    if (!row.range_m || !bound) continue;
    row.sigma_range_m = bound->range_m;
    row.sigma_bearing_rad = bound->bearing_rad;
    row.range_m = *row.true_range_m + bound->range_m * normal(random);
  }
  run.estimate.clear();
  for (runlog::FixRow& row : run.fixes) {
    const auto& covariance = bounds.at(row.frame).covariance;
    if (!row.x_m || !covariance) continue;
    row.verdict = "ok";
    const runlog::PoseRow pose = synthetic_pose(row.t_s);
    const Eigen::Vector3d error =
        covariance->llt().matrixL() * Eigen::Vector3d(normal(random), normal(random), normal(random));
    row.x_m = pose.x_m + error.x();
    row.y_m = pose.y_m + error.y();
    row.heading_rad = wrapped(pose.heading_rad + error.z());
    row.var_x_m2 = (*covariance)(0, 0);
    row.cov_xy_m2 = (*covariance)(0, 1);
    row.var_y_m2 = (*covariance)(1, 1);
    row.var_heading_rad2 = (*covariance)(2, 2);
    row.error_m = error.head<2>().norm();
    run.estimate.push_back({row.t_s, pose.x_m + error.x() / 2, pose.y_m + error.y() / 2, pose.heading_rad});
  }
  run.fixes.at(3).outliers = {run.map.landmarks.at(2).name};
  return run;
}

/// Removes everything that only a simulation has.
inline void remove_truth(runlog::RunData& run) {
  run.truth.clear();
  for (runlog::RangeRow& row : run.ranges) row.true_range_m.reset();
  for (runlog::FixRow& row : run.fixes) {
    row.true_x_m = row.true_y_m = row.error_m = std::nullopt;
  }
}

}  // namespace twocone::report

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
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/files/to_layers.h"
#include "apps/runs/bounds.h"
#include "apps/runs/run_data.h"
#include "tests/support/temporary_folder.h"
#include "vision/sighting.h"

namespace twocone::report {

using ScratchFolder = testing_support::TemporaryFolder;

/// A run as it could have been: a smooth wander among six pillars, ranges and fixes with noise and drop-outs, odometry
/// that drifts, pictures drawn by the mirrors' own formula. No rendering and no vision, so that only the report is
/// under test.
inline files::Robot synthetic_robot() {
  files::Robot robot;
  robot.file = "robots/lab_sim.yaml";
  robot.name = "lab";
  robot.map = "scenes/lab.map.yaml";
  robot.body_radius_m = 0.2;
  robot.drive = {"sim_povray", 0.30, 0.05, 0.5, 0.5};
  robot.lower = robot.upper = {"sim_povray", 320, 240, 15, 1};
  files::RigView view;
  view.mirror_radius_m = 0.06;
  view.lens_to_tip_m = 0.12;
  view.centre_px = {159.5, 119.5};
  view.rim_radius_px = 116;
  robot.rig.lower = robot.rig.upper = view;
  robot.rig.mirror_separation_m = 0.30;
  robot.rig.lens_height_m = 0.25;
  return robot;
}

inline files::Map synthetic_map() {
  files::Map map;
  map.file = "scenes/lab.map.yaml";
  map.unit_m = 0.05;
  map.bounds = {-3.05, 3.05, -2.55, 2.55};
  map.landmarks = {{"red", {1, 0, 0}, -2.5, -2.0, 0.075, 0.9},    {"green", {0, 1, 0}, 0.1, -2.2, 0.075, 0.9},
                   {"blue", {0, 0, 1}, 2.6, -1.9, 0.075, 0.9},    {"cyan", {0, 1, 1}, 2.5, 2.0, 0.075, 0.9},
                   {"magenta", {1, 0, 1}, -0.2, 2.2, 0.075, 0.9}, {"yellow", {1, 1, 0}, -2.6, 1.9, 0.075, 0.9}};
  map.obstacles = {files::Polygon{{-1.0, 1.9}, {-0.4, 1.9}, {-0.4, 2.5}, {-1.0, 2.5}}, files::Circle{{2.3, 0.2}, 0.25}};
  return map;
}

/// The true pose at `t_s`: loops of changing curvature about the middle.
inline runs::PoseRow synthetic_pose(double t_s) {
  const double w = 0.31;
  const double dx = 1.3 * w * std::cos(w * t_s) - 0.25 * 2.7 * w * std::sin(2.7 * w * t_s);
  const double dy = -1.0 * w * std::sin(w * t_s + 0.4) + 0.2 * 1.9 * w * std::cos(1.9 * w * t_s);
  return {t_s, 1.3 * std::sin(w * t_s) + 0.25 * std::cos(2.7 * w * t_s),
          1.0 * std::cos(w * t_s + 0.4) + 0.2 * std::sin(1.9 * w * t_s), std::atan2(dy, dx)};
}

inline double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

inline runs::RangeRow synthetic_range(const runs::RunData& run, const runs::FrameRow& frame,
                                      const files::Landmark& landmark, std::mt19937_64& dice) {
  const runs::PoseRow pose = synthetic_pose(frame.t_s);
  const double true_m = std::hypot(landmark.x_m - pose.x_m, landmark.y_m - pose.y_m);
  const double bearing = wrapped(std::atan2(landmark.y_m - pose.y_m, landmark.x_m - pose.x_m) - pose.heading_rad);
  runs::RangeRow row{frame.frame, frame.t_s, landmark.name, "ok", {}, {}, {}, {}, {}, {}};
  row.true_range_m = true_m;
  row.bearing_rad = bearing;
  const files::RigView& view = run.robot.rig.lower;
  const double vs =
      (view.lens_to_tip_m / view.mirror_radius_m + 1) * view.rim_radius_px * run.robot.rig.mirror_separation_m;
  const double disparity = vs / (true_m + view.lens_to_tip_m) + std::uniform_real_distribution<>(-0.5, 0.5)(dice);
  const double luck = std::uniform_real_distribution<>(0, 1)(dice);
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

/// A mirror's picture: a grey room, each pillar from its foot's side of the tip to its top.
inline cv::Mat synthetic_picture(const runs::RunData& run, const vision::MirrorView& view, const runs::PoseRow& pose) {
  cv::Mat picture(run.robot.lower.height_px, run.robot.lower.width_px, CV_8UC3, cv::Scalar::all(20));
  const auto& s = view.settings();
  const cv::Point centre(cvRound(s.centre_px.x()), cvRound(s.centre_px.y()));
  cv::circle(picture, centre, static_cast<int>(s.rim_radius_px), cv::Scalar(150, 155, 160), cv::FILLED, cv::LINE_AA);
  for (const files::Landmark& landmark : run.map.landmarks) {
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
    cv::fillPoly(picture, std::vector<std::vector<cv::Point>>{corners}, cv::Scalar(255 * c[2], 255 * c[1], 255 * c[0]));
  }
  return picture;
}

/// @param pictures frames that get pictures: every one of the given step; 0: none
inline runs::RunData synthetic_run(const std::filesystem::path& folder, int frames, int picture_step = 0,
                                   files::Map map = synthetic_map()) {
  runs::RunData run;
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
  std::mt19937_64 dice(20061);
  std::normal_distribution<> noise(0, 0.018);
  double drift_x = 0;
  double drift_y = 0;
  for (int i = 0; i < frames; ++i) {
    runs::FrameRow frame;
    frame.frame = static_cast<std::uint64_t>(i);
    frame.t_s = frame.lower_t_s = frame.upper_t_s = i / 15.0;
    run.frames.push_back(frame);
    const runs::PoseRow pose = synthetic_pose(frame.t_s);
    run.truth.push_back(pose);
    drift_x += 0.00035 * std::cos(0.01 * i);
    drift_y += 0.00025;
    run.odometry.push_back({frame.t_s, pose.x_m + drift_x, pose.y_m + drift_y, pose.heading_rad});
    int usable = 0;
    for (const files::Landmark& landmark : run.map.landmarks) {
      run.ranges.push_back(synthetic_range(run, frame, landmark, dice));
      usable += run.ranges.back().range_m ? 1 : 0;
    }
    runs::FixRow fix;
    fix.frame = frame.frame;
    fix.t_s = frame.t_s;
    fix.true_x_m = pose.x_m;
    fix.true_y_m = pose.y_m;
    fix.verdict = usable < 3 || i % 61 == 60 ? "too_few" : i % 23 == 22 ? "gap" : "ok";
    if (fix.verdict != "too_few") {
      fix.x_m = pose.x_m + noise(dice);
      fix.y_m = pose.y_m + noise(dice);
      fix.error_m = std::hypot(*fix.x_m - pose.x_m, *fix.y_m - pose.y_m);
    }
    run.fixes.push_back(fix);
  }
  if (picture_step > 0) {
    std::filesystem::create_directories(runs::lower_picture(folder, 0).parent_path());
    std::filesystem::create_directories(runs::upper_picture(folder, 0).parent_path());
    const vision::Rig rig = files::to_rig(run.robot);
    for (std::size_t i = 0; i < run.frames.size(); i += static_cast<std::size_t>(picture_step)) {
      cv::imwrite(runs::lower_picture(folder, run.frames[i].frame).string(),
                  synthetic_picture(run, rig.lower, run.truth[i]));
      cv::imwrite(runs::upper_picture(folder, run.frames[i].frame).string(),
                  synthetic_picture(run, rig.upper, run.truth[i]));
    }
  }
  return run;
}

/// The run as method `full` would tell it: sightings whose outlines have this noise, and ranges and fixes that are off
/// by just what the Cramer-Rao bound allows and say so.
inline runs::RunData full_run(runs::RunData run, double edge_noise_px = 0.08) {
  run.method = "full";
  const vision::Rig rig = files::to_rig(run.robot);
  const auto truth = runs::at_frames(run, run.truth);
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const Eigen::Rotation2Dd R_BW(-truth[i]->heading_rad);
    for (const files::Landmark& landmark : run.map.landmarks) {
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
  std::map<std::uint64_t, runs::FrameBound> bounds;
  for (const runs::FrameBound& bound : runs::bounds(run)) bounds[bound.frame] = bound;
  std::mt19937_64 dice(31);
  std::normal_distribution<> normal;
  for (std::size_t i = 0; i < run.ranges.size(); ++i) {
    runs::RangeRow& row = run.ranges[i];
    const auto& bound = bounds.at(row.frame).landmarks[i % run.map.landmarks.size()];
    if (!row.range_m || !bound) continue;
    row.sigma_range_m = bound->range_m;
    row.sigma_bearing_rad = bound->bearing_rad;
    row.range_m = *row.true_range_m + bound->range_m * normal(dice);
  }
  run.estimate.clear();
  for (runs::FixRow& row : run.fixes) {
    const auto& covariance = bounds.at(row.frame).covariance;
    if (!row.x_m || !covariance) continue;
    row.verdict = "ok";
    const runs::PoseRow pose = synthetic_pose(row.t_s);
    const Eigen::Vector3d error =
        covariance->llt().matrixL() * Eigen::Vector3d(normal(dice), normal(dice), normal(dice));
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

/// The same without what only a simulation has.
inline void remove_truth(runs::RunData& run) {
  run.truth.clear();
  for (runs::RangeRow& row : run.ranges) row.true_range_m.reset();
  for (runs::FixRow& row : run.fixes) {
    row.true_x_m.reset();
    row.true_y_m.reset();
    row.error_m.reset();
  }
}

}  // namespace twocone::report

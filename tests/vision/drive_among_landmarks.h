// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "tests/vision/lab_rig.h"
#include "vision/calibration.h"

namespace twocone::vision {

inline constexpr double kDegree = std::numbers::pi / 180;
/// Each parameter must be found within this many of its stated sigmas. One in 370 of a Gaussian is not, so with fixed
/// seeds a failure is a change of the answer.
inline constexpr double kCalibrationSigmas = 3;

inline std::size_t index_of(const CalibrationResult& result, std::string_view name) {
  const auto found = std::ranges::find(result.parameters, name, &CalibratedParameter::name);
  if (found == result.parameters.end()) throw std::runtime_error("no parameter " + std::string(name));
  return std::size_t(found - result.parameters.begin());
}

inline const CalibratedParameter& parameter(const CalibrationResult& result, std::string_view name) {
  return result.parameters[index_of(result, name)];
}

/// The true world, and the noise of its measurements.
struct DriveSettings {
  std::vector<Landmark> landmarks{{"red", {}, -2.45, -0.35, 0.15, 0.9},    {"green", {}, -1.40, 1.95, 0.15, 0.9},
                                  {"blue", {}, 1.50, 1.95, 0.15, 0.9},     {"cyan", {}, 2.45, 0.30, 0.15, 0.9},
                                  {"magenta", {}, 1.30, -1.95, 0.15, 0.9}, {"yellow", {}, -1.50, -1.95, 0.15, 0.9}};
  Rig rig = lab_rig();
  double left_wheel_m = 0.05, right_wheel_m = 0.05, wheel_separation_m = 0.30;
  double slip = 0.01;
  double noise_px = 0.1;
  double outlier_share = 0;
  double duration_s = 30;
  double every_s = 0.4;  ///< time between frames
  bool still = false;
  double latency_s = 0, upper_skew_s = 0;
  std::array<double, 2> readout_s{};  ///< lower, upper
  double upper_late_s = 0;            ///< according to the stamp
  bool gives_twists = false;
  std::uint64_t seed = 1;
};

/// Pose (x, y, heading) on loops of changing curvature about the lab's middle.
inline Eigen::Vector3d pose_on_loop(double t_s) {
  const double w = 0.31;
  const double dx = 1.3 * w * std::cos(w * t_s) - 0.25 * 2.7 * w * std::sin(2.7 * w * t_s);
  const double dy = -1.0 * w * std::sin(w * t_s + 0.4) + 0.2 * 1.9 * w * std::cos(1.9 * w * t_s);
  return {1.3 * std::sin(w * t_s) + 0.25 * std::cos(2.7 * w * t_s),
          1.0 * std::cos(w * t_s + 0.4) + 0.2 * std::sin(1.9 * w * t_s), std::atan2(dy, dx)};
}

constexpr int kDriveHeight_px = 480;

/// The body's twist at a step, from the encoders' counts 1/15 s before and after; at either end from one side only.
inline BodyTwist twist_at(std::size_t step, const std::vector<std::array<double, 2>>& angles, double count_rad,
                          double step_s) {
  constexpr std::size_t kReach = 67;
  const std::size_t from = step < kReach ? 0 : step - kReach;
  const std::size_t to = std::min(step + kReach, angles.size() - 1);
  double ways_m[2];
  for (const std::size_t wheel : {0, 1}) {
    const double counts = std::round(angles[to][wheel] / count_rad) - std::round(angles[from][wheel] / count_rad);
    ways_m[wheel] = 0.05 * count_rad * counts;  // the believed radius
  }
  const double time_s = double(to - from) * step_s;
  return {(ways_m[0] + ways_m[1]) / 2 / time_s, (ways_m[1] - ways_m[0]) / 0.30 / time_s};
}

/// The pixel of a landmark's near point at the time when the row in which it appears is exposed; without noise.
inline std::optional<Eigen::Vector2d> pixel_on_loop(const DriveSettings& world, const Landmark& landmark, Side side,
                                                    double stamp_s) {
  const bool is_lower = side == Side::kLower;
  const MirrorView& view = is_lower ? world.rig.lower : world.rig.upper;
  double row = (kDriveHeight_px - 1) / 2.0;
  std::optional<Eigen::Vector2d> pixel;
  // One row more in the time moves the pixel's row by some 1e-4 of a row: the third round is exact to rounding.
  for (int round = 0; round < 3; ++round) {
    const double readout_s = world.readout_s[is_lower ? 0 : 1] * (row / (kDriveHeight_px - 1) - 0.5);
    const double skew_s = is_lower ? 0 : world.upper_skew_s;
    const Eigen::Vector3d pose = pose_on_loop(world.still ? 2 : stamp_s - world.latency_s + skew_s + readout_s);
    const Eigen::Vector2d p_BL = Eigen::Rotation2Dd(-pose.z()) * (place_m(landmark) - Eigen::Vector2d(pose.head<2>()));
    const Eigen::Vector2d outwards = (p_BL - view.settings().axis_offset_m).normalized();
    const Eigen::Vector2d near = p_BL - landmark.radius_m * outwards;
    pixel = view.project({near.x(), near.y(), landmark.top_m});
    if (!pixel) break;
    row = pixel->y();
  }
  return pixel;
}

/// The sightings and readings of a robot on that loop. This world shares no formula with the solver: near points come
/// from the definition, pixels from MirrorView, angles from the travel of each wheel in steps of a millisecond.
inline std::vector<CalibrationFrame> drive_among_landmarks(const DriveSettings& world) {
  std::mt19937_64 random(world.seed);
  std::normal_distribution<> normal;
  std::uniform_real_distribution<> uniform(-1, 1);
  constexpr double kStep_s = 1e-3;
  constexpr double kCorrelation_s = 2.0;
  constexpr double kReading_s = 1.0 / 15;
  constexpr double kCount_rad = 2 * std::numbers::pi / 1024;
  const double decay = std::exp(-kStep_s / kCorrelation_s);
  double slips[2] = {world.slip * normal(random), world.slip * normal(random)};
  double angles[2] = {0.3, 0.7};
  const auto reading = [&](double t_s) {
    return WheelReading{t_s, std::round(angles[0] / kCount_rad) * kCount_rad,
                        std::round(angles[1] / kCount_rad) * kCount_rad};
  };
  std::vector<CalibrationFrame> frames;
  std::vector<WheelReading> readings{reading(0)};
  std::vector<std::array<double, 2>> angles_of_steps;
  std::vector<std::size_t> steps_of_frames;
  double next_frame_s = 0;
  for (int step = 0; step * kStep_s <= world.duration_s; ++step) {
    const double t_s = step * kStep_s;
    const Eigen::Vector3d pose = pose_on_loop(world.still ? 2 : t_s);
    angles_of_steps.push_back({angles[0], angles[1]});
    if (t_s - readings.back().t_s >= kReading_s) readings.push_back(reading(t_s));
    if (t_s >= next_frame_s) {
      next_frame_s += world.every_s;
      if (readings.back().t_s != t_s) readings.push_back(reading(t_s));
      CalibrationFrame& frame = frames.emplace_back();
      steps_of_frames.push_back(std::size_t(step));
      if (frames.size() > 1) frame.wheels = readings;
      readings = {readings.back()};
      for (std::size_t i = 0; i < world.landmarks.size(); ++i) {
        const Landmark& landmark = world.landmarks[i];
        for (const Side side : {Side::kLower, Side::kUpper}) {
          const double late_s = side == Side::kLower ? 0 : world.upper_late_s;
          auto pixel = pixel_on_loop(world, landmark, side, t_s + late_s);
          if (!pixel) continue;
          *pixel += world.noise_px * Eigen::Vector2d(normal(random), normal(random));
          if (std::abs(uniform(random)) < world.outlier_share)
            *pixel += 30 * Eigen::Vector2d(uniform(random), uniform(random));
          const double variance = std::max(world.noise_px * world.noise_px, 1e-12);
          frame.sightings.push_back(
              {i, side, {*pixel, variance * Eigen::Matrix2d::Identity(), world.noise_px}, late_s});
        }
      }
    }
    if (world.still) continue;
    // The wheels' travel over this step, from the pose one step later.
    const Eigen::Vector3d next = pose_on_loop(t_s + kStep_s);
    const double way = (next.head<2>() - pose.head<2>()).norm();
    const double turn = std::remainder(next.z() - pose.z(), 2 * std::numbers::pi);
    const double ways[2] = {way - turn * world.wheel_separation_m / 2, way + turn * world.wheel_separation_m / 2};
    const double radii[2] = {world.left_wheel_m, world.right_wheel_m};
    for (const int wheel : {0, 1}) {
      angles[wheel] += ways[wheel] / (radii[wheel] * (1 + slips[wheel]));
      slips[wheel] = decay * slips[wheel] + world.slip * std::sqrt(1 - decay * decay) * normal(random);
    }
  }
  for (std::size_t i = 0; world.gives_twists && i < frames.size(); ++i) {
    frames[i].twist = twist_at(steps_of_frames[i], angles_of_steps, kCount_rad, kStep_s);
  }
  return frames;
}

}  // namespace twocone::vision

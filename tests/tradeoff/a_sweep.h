// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// Returns `value` with an interval of `percent` to either side.
inline Interval about(double value, double percent) {
  return {value, value / (1 + percent / 100), value * (1 + percent / 100)};
}

/// Returns 640x480, +R2, outline fine, 6 landmarks, ranges and bearings, 15 Hz, single frames.
inline Setting usual_setting() { return {.images = {640, 480, 2, Effects::kScene}, .landmarks = 6, .rate_hz = 15}; }

/// Returns the figures that choices and conclusions use, all with intervals of `percent`; all 100 frames have answers.
inline SettingResult result_of(const Setting& setting, double error_m, double robot_s, double render_s,
                               double percent = 5) {
  SettingResult r;
  r.setting = setting;
  r.frames = r.answered = 100;
  r.position_m.emplace();
  r.position_m->mean = about(error_m, percent);
  r.robot.p95_s = r.vision.median_s = about(robot_s, percent);
  r.render_cpu.median_s = about(render_s, percent);
  return r;
}

// ---- an invented sweep with numbers like the lab's: 82 settings, frontiers marked

inline Interval around(double value, double share) { return {value, value * (1 - share), value * (1 + share)}; }

inline TimeFigures times(double median_s) {
  return {around(median_s, 0.02), 0.06 * median_s, around(1.15 * median_s, 0.05)};
}

/// Returns a result by rough laws of growth, fitted to times and errors of the lab's runs.
inline SettingResult a_result(const Setting& setting, std::size_t number) {
  const double pixels = double(setting.images.width_px) * setting.images.height_px / (320.0 * 240.0);
  const int rays = setting.images.antialias;
  const double wobble = 1 + 0.11 * std::sin(2.399 * double(number));  // settings also differ by chance
  const bool flat = setting.images.effects == Effects::kFlat;
  const double render_s =
      (flat ? 0.5 : 1.0) * (0.04 + 0.16 * std::pow(pixels, 0.93)) * (1 + 1.25 * (rays - 1)) * wobble;

  const double fine_m = 0.7e-3 * std::pow(pixels, -0.6) * std::pow(rays, -1.9) + 0.015e-3 * std::pow(pixels, -0.3);
  const double fine_s = 0.55e-3 * std::pow(pixels, 0.87), root = std::pow(pixels, -0.5);
  auto [error_m, vision_s] = std::map<Level, std::pair<double, double>>{
      {Level::kPaper, {27e-3 * root, 0.35e-3 * std::pow(pixels, 0.95)}},
      {Level::kFound, {9e-3 * root, 0.45 * fine_s}},
      {Level::kCoarse, {4 * fine_m, 0.6 * fine_s}},
      {Level::kFine, {fine_m, fine_s}},
      {Level::kAdaptive, {std::max(1.08 * fine_m, 0.5 * setting.enough_m), 0.72 * fine_s}}}[setting.level];
  if (setting.images.effects == Effects::kNoise) error_m *= 1.7;
  if (!setting.bearings) error_m *= 1.6;
  error_m *= std::sqrt(6.0 / setting.landmarks) / std::sqrt(double(setting.frames)) * wobble;
  if (setting.images.width_px < 200 && setting.level != Level::kPaper) error_m *= 1.4;

  SettingResult result;
  result.setting = setting;
  result.frames = 96;
  result.answered = setting.landmarks < 4 ? 80 : 96;
  const Interval mean = around(error_m, 0.09);
  result.position_m = ErrorFigures{mean, around(1.2 * error_m, 0.1), around(2.3 * error_m, 0.15), 3.4 * error_m};
  result.heading_rad =
      ErrorFigures{around(error_m / 2, 0.1), around(error_m / 1.6, 0.1), around(error_m, 0.15), 1.6 * error_m};
  result.range_m =
      ErrorFigures{around(1.3 * error_m, 0.07), around(1.6 * error_m, 0.07), around(3 * error_m, 0.1), 5 * error_m};
  if (setting.level != Level::kPaper) {
    result.coverage = Interval{0.94, 0.88, 0.97};
    result.bound_m = 0.8 * fine_m / std::sqrt(double(setting.frames));
  }
  result.render_cpu = times(render_s);
  result.vision = times(vision_s);
  result.localisation = times(setting.level == Level::kPaper ? 4e-6 : 11e-6);
  result.robot = times(vision_s + result.localisation.median_s.value);
  result.peak_bytes = 31e6 + 22e6 * pixels;
  result.render_bytes = 48e6 + 3e6 * pixels;
  return result;
}

inline Sweep a_sweep() {
  Sweep sweep;
  sweep.robot = "robots/lab.yaml";
  sweep.map = "scenes/lab.yaml";
  sweep.version = "0.7.0";
  sweep.commit = "0123abc";
  sweep.compiler = "GNU 12.2.0, Release";
  sweep.machine = "a processor, 2 cores";
  sweep.repeat = "twocone tradeoff --robot robots/lab.yaml --seed 1 --episodes 24 --out tradeoff";
  sweep.seed = 1;
  sweep.episodes = 24;
  sweep.landmarks = {"red", "green", "blue", "cyan", "magenta", "yellow"};
  const auto add = [&](const Setting& setting) { sweep.settings.push_back(a_result(setting, sweep.settings.size())); };
  struct Size {
    int width_px, height_px, most_rays;
  };
  for (const Size size : {Size{160, 120, 2}, {320, 240, 3}, {480, 360, 2}, {640, 480, 3}, {1280, 960, 2}}) {
    for (int rays = 1; rays <= size.most_rays; ++rays) {
      const Images images{size.width_px, size.height_px, rays, Effects::kScene};
      for (const Level level : {Level::kPaper, Level::kFound, Level::kCoarse, Level::kFine}) {
        add({images, level, 0, 6, true, 15, 1});
      }
      add({images, Level::kFine, 0, 6, true, 15, 4});
      if (size.width_px == 640 && rays == 1) sweep.as_is = sweep.settings.size() - 2;
    }
  }
  const Images usual{640, 480, 1, Effects::kScene};
  for (const double enough_m : {0.0005, 0.001, 0.002, 0.005}) add({usual, Level::kAdaptive, enough_m, 6, true, 15, 1});
  for (const int landmarks : {3, 4, 5}) add({usual, Level::kFine, 0, landmarks, true, 15, 1});
  for (const int frames : {2, 4, 8}) add({usual, Level::kAdaptive, 0.001, 6, true, 15, frames});
  for (const double rate_hz : {5.0, 30.0}) add({usual, Level::kFine, 0, 6, true, rate_hz, 4});
  add({usual, Level::kFine, 0, 6, false, 15, 1});
  for (const Effects effects : {Effects::kFlat, Effects::kNoise}) {
    for (const int frames : {1, 4}) {
      add({{640, 480, 1, effects}, Level::kFine, 0, 6, true, 15, frames});
      add({{640, 480, 2, effects}, Level::kFine, 0, 6, true, 15, frames});
    }
  }
  // A setting that never answers.
  add({{80, 60, 1, Effects::kScene}, Level::kFine, 0, 6, true, 15, 1});
  SettingResult& blind = sweep.settings.back();
  blind.answered = 0;
  blind.position_m = blind.heading_rad = blind.range_m = {};
  blind.coverage = {};
  blind.bound_m = {};
  mark_frontiers(sweep.settings);
  return sweep;
}

}  // namespace twocone::tradeoff

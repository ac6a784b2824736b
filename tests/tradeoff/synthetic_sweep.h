// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// Returns `value` with an interval of `percent` to either side.
inline Interval about(double value, double percent) {
  return {value, value / (1 + percent / 100), value * (1 + percent / 100)};
}

/// Returns 640x480, +R2, outline fine, 6 landmarks, ranges and bearings, 15 Hz, single frames.
inline Setting usual_setting() {
  Setting s;
  s.images = {640, 480, 2, Effects::kScene};
  s.landmarks = 6;
  s.rate_hz = 15;
  return s;
}

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

}  // namespace twocone::tradeoff

// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include <fmt/format.h>

namespace twocone::tradeoff {
namespace {

/// Returns the value of the key `stage`. Method paper has no stage, so it keeps the default.
std::string_view stage_of(Level level) { return name(level == Level::kPaper ? Level::kFine : level); }

std::string level_words(const Setting& s) {
  if (s.level == Level::kPaper) return "paper";
  if (s.level == Level::kAdaptive) return fmt::format("adaptive to {:g} mm", 1000 * s.enough_m);
  return fmt::format("outline, {}", stage_of(s.level));
}

/// In the order of Axis.
constexpr std::array<AxisFacts, kAllAxes.size()> kAxisFacts{{
    {"size", "image size", true, true,
     [](const Setting& s) { return fmt::format("{}x{}", s.images.width_px, s.images.height_px); },
     [](const Setting& s) { return AxisPlace(double(s.images.width_px) * s.images.height_px, s.images.width_px); }},
    {"antialias", "anti-aliasing", true, true,
     [](const Setting& s) { return s.images.antialias > 1 ? fmt::format("+R{}", s.images.antialias) : "none"; },
     [](const Setting& s) { return AxisPlace(s.images.antialias, 0); }},
    {"effects", "effects", true, false, [](const Setting& s) { return std::string(name(s.images.effects)); },
     [](const Setting& s) { return AxisPlace(int(s.images.effects), 0); }},
    {"estimator", "estimator", false, false, level_words,
     [](const Setting& s) { return AxisPlace(int(s.level), s.enough_m); }},
    {"landmarks", "landmarks", false, true, [](const Setting& s) { return fmt::to_string(s.landmarks); },
     [](const Setting& s) { return AxisPlace(s.landmarks, 0); }},
    {"bearings", "bearings", false, false,
     [](const Setting& s) { return std::string(s.uses_bearings() ? "ranges and bearings" : "ranges"); },
     [](const Setting& s) { return AxisPlace(s.bearings ? 1 : 0, 0); }},
    {"rate", "frame rate", false, true, [](const Setting& s) { return fmt::format("{:g} Hz", s.rate_hz); },
     [](const Setting& s) { return AxisPlace(s.rate_hz, 0); }},
    {"frames", "frames fused", false, true, [](const Setting& s) { return fmt::to_string(s.frames); },
     [](const Setting& s) { return AxisPlace(s.frames, 0); }},
}};

}  // namespace

const AxisFacts& facts_of(Axis axis) { return kAxisFacts.at(std::size_t(axis)); }

std::string_view name(Level level) {
  constexpr std::array<std::string_view, 5> kNames{"paper", "found", "coarse", "fine", "adaptive"};
  return kNames.at(std::size_t(level));
}

std::string_view name(Effects effects) {
  constexpr std::array<std::string_view, 3> kNames{"scene", "flat", "noise"};
  return kNames.at(std::size_t(effects));
}

std::string describe(const Setting& setting) {
  const auto value = [&](Axis axis) { return facts_of(axis).value(setting); };
  return fmt::format("{}, anti-aliasing {}, {}, {}, {} landmarks, {}, {}, {}", value(Axis::kSize),
                     value(Axis::kAntialias), value(Axis::kEffects), value(Axis::kLevel), setting.landmarks,
                     value(Axis::kBearings), value(Axis::kRate),
                     setting.frames == 1 ? "single frames" : fmt::format("{} frames", setting.frames));
}

config::Robot robot_of(const Setting& setting, const config::Robot& robot, std::span<const std::string> landmarks) {
  config::Robot changed = config::scaled(robot, double(setting.images.width_px) / robot.lower.settings.width_px);
  for (auto* camera : {&changed.lower, &changed.upper}) {
    camera->settings.rate_hz = setting.rate_hz;
    camera->antialias = setting.images.antialias;
    if (setting.images.effects == Effects::kNoise && camera->effects.full_well_electrons == 0) {
      camera->effects.full_well_electrons = kNoiseElectrons;
    }
  }
  for (auto& other : changed.others) other.part.settings.rate_hz = setting.rate_hz;
  config::EstimatorKeys& keys = changed.estimator = {};
  keys.method = estimation::to_string(method_of(setting.level));
  keys.stage = stage_of(setting.level);
  if (std::size_t(setting.landmarks) < landmarks.size()) {
    keys.landmarks.assign(landmarks.begin(), landmarks.begin() + setting.landmarks);
  }
  keys.bearings = setting.bearings;
  if (setting.level == Level::kAdaptive) keys.enough_m = setting.enough_m;
  return changed;
}

config::Map map_of(const Setting& setting, const config::Map& map) {
  config::Map changed = map;
  if (setting.images.effects == Effects::kFlat) {
    config::SceneEffects& effects = changed.effects;
    effects.shadows = effects.area_lights = effects.photons = effects.radiosity = effects.media = false;
  }
  return changed;
}

estimation::Method method_of(Level level) {
  return level == Level::kPaper ? estimation::Method::kPaper : estimation::Method::kOutline;
}

std::vector<std::size_t> pareto_frontier(std::span<const CostAndError> points) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (std::isfinite(points[i].cost) && std::isfinite(points[i].error)) order.push_back(i);
  }
  std::ranges::sort(order, {}, [&](std::size_t i) { return std::tuple(points[i].cost, points[i].error, i); });
  double least = std::numeric_limits<double>::infinity();
  std::erase_if(order, [&](std::size_t i) {
    if (points[i].error >= least) return true;
    least = points[i].error;
    return false;
  });
  return order;
}

void mark_frontiers(std::vector<SettingResult>& settings) {
  constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();
  std::vector<CostAndError> robot, simulation;
  for (SettingResult& s : settings) {
    s.on_robot_frontier = s.on_simulation_frontier = false;
    const double error = answers_enough(s) ? s.position_m->mean.value : kNoFigure;
    // Other effects are left out, because a robot cannot choose its light or the noise of its sensor.
    robot.push_back({s.robot_time_s().value, s.setting.images.effects == Effects::kScene ? error : kNoFigure});
    simulation.push_back({s.simulation_time_s().value, error});
  }
  for (const std::size_t i : pareto_frontier(robot)) settings[i].on_robot_frontier = true;
  for (const std::size_t i : pareto_frontier(simulation)) settings[i].on_simulation_frontier = true;
}

}  // namespace twocone::tradeoff

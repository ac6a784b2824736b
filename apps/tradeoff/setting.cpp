// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/setting.h"

#include <array>
#include <cassert>

#include <fmt/format.h>

#include "apps/config/robot_file.h"

namespace twocone::tradeoff {
namespace {

constexpr std::array kAxes{Axis::kSize,      Axis::kAntialias, Axis::kEffects, Axis::kLevel,
                           Axis::kLandmarks, Axis::kBearings,  Axis::kRate,    Axis::kFrames};

/// Method paper has no stage of its own.
std::string_view stage_of(Level level) { return name(level == Level::kPaper ? Level::kFine : level); }

}  // namespace

std::span<const Axis> all_axes() { return kAxes; }

std::string_view name(Axis axis) {
  constexpr std::array<std::string_view, kAxes.size()> kNames{"size",      "antialias", "effects", "estimator",
                                                              "landmarks", "bearings",  "rate",    "frames"};
  return kNames.at(std::size_t(axis));
}

std::string_view name(Level level) {
  constexpr std::array<std::string_view, 5> kNames{"paper", "found", "coarse", "fine", "adaptive"};
  return kNames.at(std::size_t(level));
}

std::string_view name(Effects effects) {
  constexpr std::array<std::string_view, 3> kNames{"scene", "flat", "noise"};
  return kNames.at(std::size_t(effects));
}

std::string value(const Setting& setting, Axis axis) {
  switch (axis) {
    case Axis::kSize:
      return fmt::format("{}x{}", setting.images.width_px, setting.images.height_px);
    case Axis::kAntialias:
      return setting.images.antialias > 1 ? fmt::format("+R{}", setting.images.antialias) : "none";
    case Axis::kEffects:
      return std::string(name(setting.images.effects));
    case Axis::kLevel:
      if (setting.level == Level::kPaper) return "paper";
      if (setting.level == Level::kAdaptive) return fmt::format("adaptive to {:g} mm", 1000 * setting.enough_m);
      return fmt::format("outline, {}", stage_of(setting.level));
    case Axis::kLandmarks:
      return fmt::format("{}", setting.landmarks);
    case Axis::kBearings:
      return setting.uses_bearings() ? "ranges and bearings" : "ranges";
    case Axis::kRate:
      return fmt::format("{:g} Hz", setting.rate_hz);
    case Axis::kFrames:
      return fmt::format("{}", setting.frames);
  }
  assert(false);
  return "";
}

std::string describe(const Setting& setting) {
  return fmt::format("{}, anti-aliasing {}, {}, {}, {} landmarks, {}, {}, {}", value(setting, Axis::kSize),
                     value(setting, Axis::kAntialias), value(setting, Axis::kEffects), value(setting, Axis::kLevel),
                     setting.landmarks, value(setting, Axis::kBearings), value(setting, Axis::kRate),
                     setting.frames == 1 ? "single frames" : fmt::format("{} frames", setting.frames));
}

config::Robot robot_of(const Setting& setting, const config::Robot& robot, std::span<const std::string> landmarks) {
  config::Robot changed = config::scaled(robot, double(setting.images.width_px) / robot.lower.width_px);
  for (config::CameraEntry* camera : {&changed.lower, &changed.upper}) {
    camera->rate_hz = setting.rate_hz;
    camera->antialias = setting.images.antialias;
    if (setting.images.effects == Effects::kNoise && camera->effects.full_well_electrons == 0) {
      camera->effects.full_well_electrons = kNoiseElectrons;
    }
  }
  for (config::NamedCameraEntry& other : changed.others) other.camera.rate_hz = setting.rate_hz;
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

}  // namespace twocone::tradeoff

// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/axis_groups.h"

#include <stdexcept>

namespace twocone::tradeoff {
namespace {

/// Returns an equal setting for all settings that differ in this axis only.
Setting without(Setting setting, Axis axis) {
  const Setting none;
  switch (axis) {
    case Axis::kSize:
      setting.images.width_px = none.images.width_px;
      setting.images.height_px = none.images.height_px;
      break;
    case Axis::kAntialias:
      setting.images.antialias = none.images.antialias;
      break;
    case Axis::kEffects:
      setting.images.effects = none.images.effects;
      break;
    case Axis::kLevel:
      setting.level = none.level;
      setting.enough_m = none.enough_m;
      break;
    case Axis::kLandmarks:
      setting.landmarks = none.landmarks;
      break;
    case Axis::kBearings:
      setting.bearings = none.bearings;
      break;
    case Axis::kRate:
      setting.rate_hz = none.rate_hz;
      break;
    case Axis::kFrames:
      setting.frames = none.frames;
      break;
  }
  return setting;
}

}  // namespace

AxisPlace axis_place(const Setting& setting, Axis axis) {
  const Images& images = setting.images;
  switch (axis) {
    case Axis::kSize:
      return {double(images.width_px) * images.height_px, images.width_px};
    case Axis::kAntialias:
      return {images.antialias, 0};
    case Axis::kEffects:
      return {int(images.effects), 0};
    case Axis::kLevel:
      return {int(setting.level), setting.enough_m};
    case Axis::kLandmarks:
      return {setting.landmarks, 0};
    case Axis::kBearings:
      return {setting.bearings ? 1 : 0, 0};
    case Axis::kRate:
      return {setting.rate_hz, 0};
    case Axis::kFrames:
      return {setting.frames, 0};
  }
  throw std::invalid_argument("axis_place: no such axis");
}

std::vector<AxisGroup> axis_groups(const Sweep& sweep, Axis axis) {
  std::map<Setting, AxisGroup> groups;
  for (const SettingResult& result : sweep.settings) {
    if (!answers_enough(result)) continue;
    groups[without(result.setting, axis)].emplace(axis_place(result.setting, axis), &result);
  }
  std::vector<AxisGroup> of_two_or_more;
  for (auto& [others, group] : groups) {
    if (group.size() > 1) of_two_or_more.push_back(std::move(group));
  }
  return of_two_or_more;
}

}  // namespace twocone::tradeoff

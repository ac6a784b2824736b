// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/axis_groups.h"

#include <stdexcept>

namespace twocone::tradeoff {

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
  std::map<std::vector<AxisPlace>, AxisGroup> groups;  // by the places on all other axes
  for (const SettingResult& result : sweep.settings) {
    if (!answers_enough(result)) continue;
    std::vector<AxisPlace> others;
    for (const Axis other : all_axes()) {
      if (other != axis) others.push_back(axis_place(result.setting, other));
    }
    groups[others].emplace(axis_place(result.setting, axis), &result);
  }
  std::vector<AxisGroup> of_two_or_more;
  for (auto& [others, group] : groups) {
    if (group.size() > 1) of_two_or_more.push_back(std::move(group));
  }
  return of_two_or_more;
}

}  // namespace twocone::tradeoff

// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera_camera/device.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/ranges.h>

namespace twocone::libcamera_camera {
namespace {

template <typename Number>
Number first_of(const lc::ControlValue& value) {
  Number number;
  std::memcpy(&number, value.data().data(), sizeof number);
  return number;
}

/// Returns the number that a value holds, or the first of several; nothing if it holds none.
std::optional<double> number_of(const lc::ControlValue& value) {
  if (value.numElements() == 0) return std::nullopt;
  switch (value.type()) {
    case lc::ControlTypeBool:
      return first_of<bool>(value) ? 1 : 0;
    case lc::ControlTypeByte:
      return first_of<std::uint8_t>(value);
    case lc::ControlTypeInteger32:
      return first_of<std::int32_t>(value);
    case lc::ControlTypeInteger64:
      return double(first_of<std::int64_t>(value));
    case lc::ControlTypeFloat:
      return double(first_of<float>(value));
    default:
      return std::nullopt;
  }
}

template <typename Integer>
Integer nearest(double number) {
  // For 64 bits the bound is about half the range, because the type's own limit is not exact as a double.
  const double most = std::min(double(std::numeric_limits<Integer>::max()), 4.0e18);
  const double least = std::max(double(std::numeric_limits<Integer>::min()), -4.0e18);
  return static_cast<Integer>(std::llround(std::clamp(number, least, most)));
}

/// Converts a number to a value of the control's type.
std::optional<lc::ControlValue> value_for(const lc::ControlId& control, double number) {
  if (is_array(control)) return std::nullopt;
  switch (control.type()) {
    case lc::ControlTypeBool:
      return lc::ControlValue(number != 0);
    case lc::ControlTypeByte:
      return lc::ControlValue(nearest<std::uint8_t>(number));
    case lc::ControlTypeInteger32:
      return lc::ControlValue(nearest<std::int32_t>(number));
    case lc::ControlTypeInteger64:
      return lc::ControlValue(nearest<std::int64_t>(number));
    case lc::ControlTypeFloat:
      return lc::ControlValue(static_cast<float>(number));
    default:
      return std::nullopt;
  }
}

double within(const lc::ControlInfo& limits, double number) {
  const auto least = number_of(limits.min());
  const auto most = number_of(limits.max());
  return least && most && *least < *most ? std::clamp(number, *least, *most) : number;
}

}  // namespace

Result<ChosenControls> choose_controls(const lc::Camera& camera, const LibcameraSettings& settings, double rate_hz) {
  const lc::ControlInfoMap& has = camera.controls();
  ChosenControls chosen{lc::ControlList(has), {}, {}};
  for (const auto& [name, asked] : settings.controls) {
    const auto control = std::find_if(
        has.begin(), has.end(), [&wanted_name = name](const auto& each) { return each.first->name() == wanted_name; });
    if (control == has.end()) {
      std::vector<std::string> names;
      for (const auto& [id, limits] : has) {
        if (!is_array(*id)) names.push_back(id->name());
      }
      std::sort(names.begin(), names.end());
      return Error(ErrorCode::kRefused, "{} has no control {}; it has: {}", camera.id(), name, fmt::join(names, ", "));
    }
    const double number = within(control->second, asked);
    const auto value = value_for(*control->first, number);
    if (!value)
      return Error(ErrorCode::kRefused, "{}: control {} is no single number; leave it out", camera.id(), name);
    chosen.list.set(control->first->id(), *value);
    chosen.applied.emplace_back(control->first, number_of(*value).value_or(number));
  }
  if (const auto limits = has.find(&lc::controls::FrameDurationLimits); limits != has.end()) {
    const auto period_us = nearest<std::int64_t>(within(limits->second, 1e6 / rate_hz));
    chosen.list.set(lc::controls::FrameDurationLimits, {period_us, period_us});
    chosen.rate_hz = 1e6 / double(period_us);
  }
  return chosen;
}

void read_back(const lc::ControlList& metadata, ChosenControls& applied) {
  for (auto& [control, number] : applied.applied) {
    if (metadata.contains(control->id())) number = number_of(metadata.get(control->id())).value_or(number);
  }
}

}  // namespace twocone::libcamera_camera

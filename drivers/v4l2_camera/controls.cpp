// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/v4l2_camera/device.h"
#include "hal/device_info.h"

namespace twocone::v4l2 {
namespace {

/// Returns the control's name as v4l2-ctl prints it: "Exposure Time, Absolute" is exposure_time_absolute.
std::string control_name(const std::string& title) {
  std::string name;
  for (const char c : title) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      name.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
    } else if (!name.empty() && name.back() != '_') {
      name.push_back('_');
    }
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

/// Replaces `control` by the one after `control.id`. Returns 0, or errno if there is none.
int next_control(const Device& device, v4l2_query_ext_ctrl& control) {
  const std::uint32_t next = control.id | V4L2_CTRL_FLAG_NEXT_CTRL;
  control = {};
  control.id = next;
  const int error = device.call(VIDIOC_QUERY_EXT_CTRL, &control);
  if (error != ENOTTY) return error;
  // Old drivers know only this call, which cannot report 64-bit bounds.
  v4l2_queryctrl old{};
  old.id = next;
  if (const int old_error = device.call(VIDIOC_QUERYCTRL, &old)) return old_error;
  control = {};
  control.id = old.id;
  control.type = old.type;
  std::memcpy(control.name, old.name, sizeof(old.name));
  control.minimum = old.minimum;
  control.maximum = old.maximum;
  control.flags = old.flags;
  return 0;
}

bool has_choices(const v4l2_query_ext_ctrl& control) {
  return control.type == V4L2_CTRL_TYPE_MENU || control.type == V4L2_CTRL_TYPE_INTEGER_MENU;
}

/// Returns whether the control is a number, not a text, an array or a title.
bool is_number(const v4l2_query_ext_ctrl& control) {
  constexpr std::array<std::uint32_t, 7> kNumbers{
      V4L2_CTRL_TYPE_INTEGER, V4L2_CTRL_TYPE_BOOLEAN,   V4L2_CTRL_TYPE_MENU,   V4L2_CTRL_TYPE_INTEGER_MENU,
      V4L2_CTRL_TYPE_BUTTON,  V4L2_CTRL_TYPE_INTEGER64, V4L2_CTRL_TYPE_BITMASK};
  const bool has_payload = (control.flags & V4L2_CTRL_FLAG_HAS_PAYLOAD) != 0;
  return !has_payload && std::ranges::find(kNumbers, control.type) != kNumbers.end();
}

/// Returns the choices that the device has, such as "1 (Manual Mode)". A menu may have gaps.
std::vector<std::string> choices(const Device& device, const v4l2_query_ext_ctrl& control, std::int64_t wanted,
                                 bool& has_wanted) {
  std::vector<std::string> all;
  for (std::int64_t i = control.minimum; i <= control.maximum; ++i) {
    v4l2_querymenu item{};
    item.id = control.id;
    item.index = std::uint32_t(i);
    if (device.call(VIDIOC_QUERYMENU, &item) != 0) continue;
    has_wanted = has_wanted || i == wanted;
    all.push_back(control.type == V4L2_CTRL_TYPE_MENU ? fmt::format("{} ({})", i, printable(text_of(item.name)))
                                                      : fmt::format("{} ({})", i, std::int64_t(item.value)));
  }
  return all;
}

/// Returns the reason why the control cannot have the value now; empty: the device reports none.
std::string objection(const Device& device, const v4l2_query_ext_ctrl& control, std::int64_t wanted) {
  if ((control.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0) return "can only be read";
  if (!is_number(control)) return "is not a number";
  // Many devices accept a value for an inactive control and do not use it.
  if ((control.flags & V4L2_CTRL_FLAG_INACTIVE) != 0) return "is inactive: another one, set before it, must free it";
  if (has_choices(control)) {
    bool has_wanted = false;
    const auto all = choices(device, control, wanted, has_wanted);
    return has_wanted ? "" : fmt::format("is {}, must be one of {}", wanted, fmt::join(all, ", "));
  }
  const bool has_bounds = control.type == V4L2_CTRL_TYPE_INTEGER || control.type == V4L2_CTRL_TYPE_BOOLEAN ||
                          (control.type == V4L2_CTRL_TYPE_INTEGER64 && control.minimum < control.maximum);
  if (has_bounds && (wanted < control.minimum || wanted > control.maximum)) {
    return fmt::format("is {}, must be {} to {}", wanted, control.minimum, control.maximum);
  }
  return "";
}

}  // namespace

Result<Control> Device::set(const Control& control) const {
  std::vector<std::string> names;
  v4l2_query_ext_ctrl found{};
  while (true) {
    const int error = next_control(*this, found);
    if (is_gone(error)) return device_error(path_, error);
    if (error != 0) break;
    if ((found.flags & V4L2_CTRL_FLAG_DISABLED) != 0 || found.type == V4L2_CTRL_TYPE_CTRL_CLASS) continue;
    const std::string name = control_name(printable(text_of(found.name)));
    if (name == control.first) return set(found, control);
    if (is_number(found) && (found.flags & V4L2_CTRL_FLAG_READ_ONLY) == 0) names.push_back(name);
  }
  return Error(ErrorCode::kRefused, "{} ({}) has no control {}; it has: {}", path_, card(), control.first,
               fmt::join(names, ", "));
}

Result<Control> Device::set(const v4l2_query_ext_ctrl& found, const Control& control) const {
  const auto& [name, wanted] = control;
  if (const std::string why = objection(*this, found, wanted); !why.empty()) {
    return Error(ErrorCode::kRefused, "{}: control {} {}; correct it in controls:", path_, name, why);
  }
  const bool is_long = found.type == V4L2_CTRL_TYPE_INTEGER64;
  v4l2_ext_control value{};
  value.id = found.id;
  if (is_long) {
    value.value64 = wanted;
  } else {
    value.value = std::int32_t(wanted);
  }
  v4l2_ext_controls values{};
  values.count = 1;
  values.controls = &value;
  if (const int error = call(VIDIOC_S_EXT_CTRLS, &values)) {
    // A camera may also answer EIO to a bad value, so only the codes of is_gone() mean a lost device.
    return Error(is_gone(error) ? ErrorCode::kDisconnected : ErrorCode::kRefused,
                 "{}: control {} = {}: {}; set it to another value, or after the controls that it depends on", path_,
                 name, wanted, std::strerror(error));
  }
  if ((found.flags & V4L2_CTRL_FLAG_WRITE_ONLY) != 0 || call(VIDIOC_G_EXT_CTRLS, &values) != 0) return control;
  if (found.type == V4L2_CTRL_TYPE_BITMASK) return Control{name, std::uint32_t(value.value)};
  return Control{name, is_long ? value.value64 : value.value};
}

}  // namespace twocone::v4l2

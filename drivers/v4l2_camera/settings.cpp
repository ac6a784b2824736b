// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/v4l2_camera/v4l2_camera.h"

namespace twocone::v4l2 {
namespace {

constexpr std::array<std::string_view, 7> kFormatNames{"YUYV", "UYVY", "NV12", "RGB3", "BGR3", "MJPG", "GREY"};

}  // namespace

void check(const V4l2Settings& settings) {
  std::string bad;
  if (settings.device.empty()) bad += " device is missing;";
  if (!settings.format.empty() &&
      std::find(kFormatNames.begin(), kFormatNames.end(), settings.format) == kFormatNames.end()) {
    bad += fmt::format(" format is '{}', must be one of {};", settings.format, fmt::join(kFormatNames, ", "));
  }
  for (const Control& control : settings.controls) {
    if (control.first.empty()) bad += " a control has no name;";
  }
  if (!bad.empty()) throw std::invalid_argument("V4l2Settings:" + bad);
}

}  // namespace twocone::v4l2

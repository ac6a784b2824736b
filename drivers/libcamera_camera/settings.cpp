// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/libcamera_camera/libcamera_camera.h"

namespace twocone::libcamera_camera {

void check(const LibcameraSettings& settings) {
  std::string bad;
  if (settings.device.empty()) bad += " device is missing;";
  if (!settings.format.empty() && std::find(kFormats.begin(), kFormats.end(), settings.format) == kFormats.end()) {
    bad += fmt::format(" format is '{}', must be one of {};", settings.format, fmt::join(kFormats, ", "));
  }
  for (const Control& control : settings.controls) {
    if (!std::isfinite(control.second)) bad += fmt::format(" control {} is {};", control.first, control.second);
  }
  if (!bad.empty()) throw std::invalid_argument("LibcameraSettings:" + bad);
}

}  // namespace twocone::libcamera_camera

// SPDX-License-Identifier: Apache-2.0
#include "hal/camera_device.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace twocone {

void check(const CameraDevice& device, std::string_view settings) {
  std::string bad;
  if (device.name.empty()) bad += " device is missing;";
  if (!device.format.empty() &&
      std::find(kCameraFormats.begin(), kCameraFormats.end(), device.format) == kCameraFormats.end()) {
    bad += fmt::format(" format is '{}', must be one of {};", device.format, fmt::join(kCameraFormats, ", "));
  }
  for (const auto& [name, value] : device.controls) {
    if (name.empty()) bad += " a control has no name;";
    if (!std::isfinite(value)) bad += fmt::format(" control {} is {};", name, value);
  }
  if (!bad.empty()) throw std::invalid_argument(fmt::format("{}:{}", settings, bad));
}

}  // namespace twocone

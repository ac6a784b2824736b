// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera_camera/module.h"

#include <cstdlib>
#include <iostream>
#include <string_view>
#include <utility>

#include <libcamera/logging.h>

#include "drivers/libcamera_camera/device.h"

namespace twocone::libcamera_camera {
namespace {

/// Suppresses libcamera's messages. libcamera prints complaints on stderr, for example about every device that it may
/// not open. A list of cameras reports that in its own words. If the user has requested libcamera's messages, nothing
/// is changed.
class Silence {
 public:
  Silence() {
    if (is_ours_) lc::logSetTarget(lc::LoggingTargetNone);
  }
  ~Silence() {
    if (is_ours_) lc::logSetStream(&std::cerr);
  }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  static bool was_asked_for() {
    const char* const levels = std::getenv("LIBCAMERA_LOG_LEVELS");
    return std::getenv("LIBCAMERA_LOG_FILE") != nullptr ||
           (levels != nullptr && std::string_view(levels) != kOurLogLevels);
  }
  const bool is_ours_ = !was_asked_for();
};

Result<std::vector<DeviceInfo>> list() {
  const Silence silence;
  const auto manager = use_manager();
  if (!manager) return manager.error();
  std::vector<DeviceInfo> cameras;
  for (const auto& camera : (*manager)->cameras()) {
    cameras.push_back({.name = printable(camera->id()), .what = model_of(*camera), .details = formats_of(*camera)});
  }
  return cameras;
}

constexpr Module kModule{list, open_here};

}  // namespace

extern "C" __attribute__((visibility("default"))) const Module* twocone_libcamera_module() { return &kModule; }

}  // namespace twocone::libcamera_camera

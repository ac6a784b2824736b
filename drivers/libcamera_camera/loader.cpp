// SPDX-License-Identifier: Apache-2.0
// Loads the module with the driver and forwards calls to it.
#include <cstdlib>

#include "base/errors.h"
#include "base/module.h"
#include "drivers/libcamera_camera/libcamera_camera.h"

namespace twocone::libcamera_camera {
namespace {

Result<const Module*> load() {
  // By default libcamera prints its version and more on stderr. A level that the user has set is kept.
  ::setenv("LIBCAMERA_LOG_LEVELS", kOurLogLevels, 0);
  try {
    return reinterpret_cast<const Module* (*)()>(base::load_module(TWOCONE_LIBCAMERA_MODULE, kModuleEntry))();
  } catch (const base::FormattedError& error) {
    return Error(ErrorCode::kUnavailable, "libcamera: {}", error.what());
  }
}

const Result<const Module*>& module() {
  static const Result<const Module*> loaded = load();
  return loaded;
}

}  // namespace

std::string_view why_not() { return ""; }

Result<std::vector<DeviceInfo>> list_cameras() {
  if (!module()) return module().error();
  return (*module())->list_cameras();
}

Result<std::unique_ptr<Camera>> open_camera(const LibcameraSettings& settings) {
  check(settings);
  if (!module()) return module().error();
  return (*module())->open_camera(settings);
}

}  // namespace twocone::libcamera_camera

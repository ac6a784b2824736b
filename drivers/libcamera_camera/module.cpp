// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera_camera/module.h"

#include <utility>

#include "drivers/libcamera_camera/camera.h"
#include "drivers/libcamera_camera/device.h"

namespace twocone::libcamera_camera {
namespace {

Result<std::vector<CameraInfo>> list() {
  const auto manager = Manager::use();
  if (!manager) return manager.error();
  std::vector<CameraInfo> cameras;
  for (const auto& camera : (*manager)->cameras()) {
    cameras.push_back({camera->id(), model_of(*camera), formats_of(*camera)});
  }
  return cameras;
}

Result<std::unique_ptr<Camera>> open(const LibcameraSettings& settings) {
  auto camera = LibcameraCamera::open(settings);
  if (!camera) return camera.error();
  return std::unique_ptr<Camera>(*std::move(camera));
}

constexpr Module kModule{list, open};

}  // namespace

extern "C" __attribute__((visibility("default"))) const Module* twocone_libcamera_module() { return &kModule; }

}  // namespace twocone::libcamera_camera

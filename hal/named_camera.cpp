// SPDX-License-Identifier: Apache-2.0
#include "hal/named_camera.h"

#include <fmt/format.h>

namespace twocone {

Error with_name(const std::string& name, const Error& error) {
  return {error.code, fmt::format("{}: {}", name, error.message)};
}

Status start_camera(const std::string& name, Camera& camera, const CameraSettings& wanted) {
  const auto applied = camera.configure(wanted);
  if (!applied) return with_name(name, applied.error());
  if (applied->width_px != wanted.width_px || applied->height_px != wanted.height_px) {
    return with_name(name,
                     {ErrorCode::kRefused,
                      fmt::format("the camera gives {} x {} pixels instead of {} x {}; ask for a size that it has",
                                  applied->width_px, applied->height_px, wanted.width_px, wanted.height_px)});
  }
  if (const auto started = camera.start(); !started) return with_name(name, started.error());
  return {};
}

}  // namespace twocone

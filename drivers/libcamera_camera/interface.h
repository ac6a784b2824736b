// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <libcamera/libcamera.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "hal/camera.h"
#include "hal/device_info.h"
#include "hal/image.h"

/// The differences between libcamera's versions, and nothing else of the driver. Version 0.0.3 was built and tested.
/// Versions 0.1 to 0.5 were not built; only their documentation and headers were read. These changes between them are
/// handled here or by the way of calling:
/// - Roles are a vector up to 0.0.x, a span later: kViewfinder fits both, a braced list does not.
/// - FrameMetadata has a status for frames of a sensor that is not yet stable (FrameStartup): a frame whose status is
///   neither success nor error is skipped, so the name of this status is not needed.
/// - Control types of unsigned numbers were added: a control of an unknown type is refused by name.
/// - From 0.4 on, ControlId reports whether it is an array.
namespace twocone::libcamera_camera {

namespace lc = libcamera;

#define TWOCONE_LIBCAMERA_IS(major, minor) \
  (LIBCAMERA_VERSION_MAJOR > (major) || (LIBCAMERA_VERSION_MAJOR == (major) && LIBCAMERA_VERSION_MINOR >= (minor)))

inline const std::vector<lc::StreamRole> kViewfinder{lc::StreamRole::Viewfinder};

/// Returns whether a control has several numbers. Setting it to one number would end the program by an assertion of
/// libcamera.
inline bool is_array(const lc::ControlId& control) {
#if TWOCONE_LIBCAMERA_IS(0, 4)
  return control.isArray();
#else
  const std::array<const lc::ControlId*, 5> arrays{&lc::controls::ColourGains, &lc::controls::SensorBlackLevels,
                                                   &lc::controls::ColourCorrectionMatrix,
                                                   &lc::controls::FrameDurationLimits, &lc::controls::AfWindows};
  return std::ranges::any_of(arrays, [&](const lc::ControlId* array) { return *array == control.id(); });
#endif
}

inline std::string model_of(const lc::Camera& camera) {
  return printable(camera.properties().get(lc::properties::Model).value_or(camera.id()));
}

struct Format {
  std::string_view name;  ///< V4L2's name
  lc::PixelFormat code;
  PixelFormat layout;
};
/// The formats of kCameraFormats. libcamera names RGB formats by their bits from the highest one, V4L2 by their bytes.
inline constexpr std::array<Format, 7> kFormats{{{kCameraFormats[0], lc::formats::YUYV, PixelFormat::kYuyv},
                                                 {kCameraFormats[1], lc::formats::UYVY, PixelFormat::kUyvy},
                                                 {kCameraFormats[2], lc::formats::NV12, PixelFormat::kNv12},
                                                 {kCameraFormats[3], lc::formats::BGR888, PixelFormat::kRgb8},
                                                 {kCameraFormats[4], lc::formats::RGB888, PixelFormat::kBgr8},
                                                 {kCameraFormats[5], lc::formats::MJPEG, PixelFormat::kMjpeg},
                                                 {kCameraFormats[6], lc::formats::R8, PixelFormat::kGrey8}}};
inline bool has_yuv(PixelFormat layout) {
  return layout == PixelFormat::kYuyv || layout == PixelFormat::kUyvy || layout == PixelFormat::kNv12;
}

}  // namespace twocone::libcamera_camera

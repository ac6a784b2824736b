// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "drivers/libcamera_camera/libcamera_camera.h"

namespace twocone::libcamera_camera {

/// The functions that the module offers to the program that loads it. Module and program must be of the same build.
struct Module {
  Result<std::vector<DeviceInfo>> (*list_cameras)();
  /// @param settings checked
  Result<std::unique_ptr<Camera>> (*open_camera)(const LibcameraSettings& settings);
};

/// Opens a camera. Its frames are in the camera's own format. They are lent if their planes are contiguous in
/// memory: a frame's buffer goes back when the last copy of the frame is destroyed. If too few buffers are left for the
/// camera, frames are copies instead. Capture times are libcamera's (SensorTimestamp if it is reported), on the steady
/// clock: the time at which the frame began to arrive.
///
/// facts() holds the controls as the camera reports them with its frames; if it does not, as they were set, within the
/// limits that it reports. The rate is the nearest to the requested one within the camera's FrameDurationLimits, if it
/// has them.
///
/// libcamera does not report that a camera stopped sending. Whatever its timeout, grab() waits at most ten frame
/// periods, or half a second if that is longer. It then asks the camera for its formats: kTimeout if it answers,
/// kDisconnected if not. After kDisconnected, configure() searches for the camera again.
///
/// libcamera 0.0.3 ends the program when a camera that is gone is stopped. Such a stream is therefore abandoned: its
/// buffers, and libcamera's thread that continues to poll the device, remain until the program ends.
///
/// @param settings checked
/// Errors: kNotFound, kRefused (another program has it), kUnavailable.
Result<std::unique_ptr<Camera>> open_here(const LibcameraSettings& settings);

/// The value that the loader gives LIBCAMERA_LOG_LEVELS if it is not set: warnings and errors. It is "*:WARN" written
/// with a number, so that the module can distinguish it from a user's request.
constexpr const char* kOurLogLevels = "*:2";
constexpr const char* kModuleEntry = "twocone_libcamera_module";

}  // namespace twocone::libcamera_camera

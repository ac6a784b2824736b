// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "hal/camera.h"
#include "hal/device_info.h"

/// Cameras that only libcamera can drive, in particular the Raspberry Pi's CSI cameras.
///
/// The driver is in a separate module, which is loaded when one of these functions needs it. The reason is that
/// libcamera brings a tracing library. That library starts threads in each program that links it, and ends the program
/// if /dev/shm is full. The module's file has the version of the public interface in its name, as the library has:
/// twocone_libcamera_1_0.so. It is searched for in $TWOCONE_MODULES, then in lib/twocone of the program's folder and of
/// the two folders above it (/usr/bin/twocone: /usr/lib/twocone), then in the installation's folder.
namespace twocone::libcamera_camera {

/// Returns why this build has no such cameras: it was made without libcamera, and opening returns kUnavailable. Empty:
/// the build has the driver, if the module is found.
std::string_view why_not();

/// The name is libcamera's id (as `cam -l` prints it), or the model's name, if only one camera has it. Without a
/// format, the first of kCameraFormats that the camera has is chosen. Controls have libcamera's names: ExposureTime
/// (microseconds), AnalogueGain, AeEnable (0 or 1).
using LibcameraSettings = CameraDevice;

/// @throws std::invalid_argument naming every bad field
inline void check(const LibcameraSettings& settings) { twocone::check(settings, "LibcameraSettings"); }

/// Lists the cameras: `name` is libcamera's id, `what` the model, `details` the formats.
/// Errors: kUnavailable (no module; libcamera does not start).
Result<std::vector<DeviceInfo>> list_cameras();

/// Opens a camera. Its frames are in the camera's own format. They are lent if their planes are contiguous in
/// memory: a frame's buffer goes back when the last copy of the frame is destroyed. If too few buffers are left for the
/// camera, frames are copies instead. Capture times are libcamera's (SensorTimestamp if it is reported), on the steady
/// clock: the time at which the frame began to arrive.
///
/// facts() holds the controls as the camera reports them with its frames; without such a report, as they were set,
/// within the camera's limits. The rate is the nearest to the requested one within the camera's FrameDurationLimits, if
/// it has them.
///
/// libcamera does not report that a camera stopped sending. Whatever its timeout, grab() waits at most ten frame
/// periods, or half a second if that is longer. It then asks the camera for its formats: kTimeout if it answers,
/// kDisconnected if not. After kDisconnected, configure() searches for the camera again.
///
/// libcamera 0.0.3 ends the program when a camera that is gone is stopped. Such a stream is therefore abandoned: its
/// buffers, and libcamera's thread that continues to poll the device, remain until the program ends.
///
/// Errors: kNotFound, kRefused (another program has it; several cameras of that model), kUnavailable, kDisconnected.
/// @throws std::invalid_argument as check() does
Result<std::unique_ptr<Camera>> open_camera(const LibcameraSettings& settings);

// ---- How the program and the module find each other.

/// The functions that the module offers to the program that loads it. Module and program must be of the same build.
struct Module {
  Result<std::vector<DeviceInfo>> (*list_cameras)();
  /// @param settings checked
  Result<std::unique_ptr<Camera>> (*open_camera)(const LibcameraSettings& settings);
};

/// The value that the loader gives LIBCAMERA_LOG_LEVELS if it is not set: warnings and errors. It is "*:WARN" written
/// with a number, so that the module can distinguish it from a user's request.
constexpr const char* kOurLogLevels = "*:2";
constexpr const char* kModuleEntry = "twocone_libcamera_module";

}  // namespace twocone::libcamera_camera

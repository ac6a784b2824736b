// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hal/camera.h"
#include "hal/camera_device.h"
#include "hal/device_info.h"

/// Cameras that only libcamera can drive, in particular the Raspberry Pi's CSI cameras.
///
/// The driver is in a separate module, which is loaded when one of these functions needs it. The reason is that
/// libcamera brings a tracing library. That library starts threads in each program that links it, and ends the program
/// if /dev/shm is full. The module's file has the version of the public interface in its name, as the library has:
/// twocone_libcamera_0_1.so. It is searched for in $TWOCONE_MODULES, then in lib/twocone of the program's folder and of
/// the two folders above it (/usr/bin/twocone: /usr/lib/twocone), then in the installation's folder.
namespace twocone::libcamera_camera {

/// The reason why this build has no such cameras: it was made without libcamera, and opening returns kUnavailable.
/// Empty: the build has the driver, if the module is found.
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

/// Errors: kNotFound, kRefused (another program has it), kUnavailable. @throws std::invalid_argument as check() does
Result<std::unique_ptr<Camera>> open_camera(const LibcameraSettings& settings);

}  // namespace twocone::libcamera_camera

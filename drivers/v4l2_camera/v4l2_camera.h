// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hal/camera.h"
#include "hal/device_info.h"

/// Cameras of the kernel's Video4Linux2 interface, streamed through memory that device and program share.
namespace twocone::v4l2 {

/// Returns why this build has no such cameras: it was made without the kernel's headers for video devices, and opening
/// returns kUnavailable. Empty: the build has the driver.
std::string_view why_not();

/// The name is a path (/dev/video0), a link to it (/dev/v4l/by-id/..., by-path/...), or the card's name, if only one
/// has it. Without a format, the first one is chosen that the camera has in the requested size. Controls have the names
/// that `v4l2-ctl --list-ctrls` prints (exposure_time_absolute, gain) and whole numbers as values. Their order matters:
/// exposure_time_absolute is refused until auto_exposure allows it. A button is pressed with any value.
using V4l2Settings = CameraDevice;

/// @throws std::invalid_argument naming every bad field
inline void check(const V4l2Settings& settings) { twocone::check(settings, "V4l2Settings"); }

/// The system calls of the driver (device.h).
class Kernel;
std::shared_ptr<Kernel> real_kernel();

/// Lists the cameras in the order of their numbers: `name` is a link that remains the same when the camera is plugged
/// in again (/dev/v4l/by-id/... or by-path/...), or else its path; `what` is the card's name, the path and the bus;
/// `details` are the modes, such as "YUYV 640x480 at 30, 15 Hz", also those of formats that the driver does not
/// support.
std::vector<DeviceInfo> list_cameras(const std::shared_ptr<Kernel>& kernel = real_kernel());

/// Returns the path, with all links resolved, of the device that V4l2Settings::name names; `device` itself if there is
/// none.
std::string node_of(const std::string& device, const std::shared_ptr<Kernel>& kernel = real_kernel());

/// Opens a camera. Its frames are in the camera's own format, and lent: a frame's buffer goes back to the device
/// when the last copy of the frame is destroyed. If too few buffers are left for the device, or if its rows are padded,
/// frames are copies instead.
///
/// Capture times are the kernel's, of the same clock as std::chrono::steady_clock. For most cameras this is the moment
/// at which the frame's first byte arrived, which is after the exposure. If a device's times are not of that clock, the
/// capture time is the time at which the program took the frame.
///
/// facts() holds the controls as read back from the device. Frames that outlive stop(), an unplug or the camera keep
/// their pixels, and do not keep the device open.
///
/// A damaged frame is reported once (kBadData) and counts as lost; the stream continues. After kDisconnected, stop()
/// and configure() search for the device again; while it is missing, configure() returns kDisconnected again. Whatever
/// its timeout, grab() waits at most ten frame periods, or half a second if that is longer (three seconds for the first
/// frame), and then returns kTimeout. So it does for a camera whose source is cut off, although that camera still
/// sends. When the source is back, grab() returns kDisconnected, because the image size may have changed.
///
/// Errors: kNotFound, kRefused (no permission; no camera; several cards of that name), kUnavailable.
/// @throws std::invalid_argument as check() does
Result<std::unique_ptr<Camera>> open_camera(const V4l2Settings& settings,
                                            std::shared_ptr<Kernel> kernel = real_kernel());

}  // namespace twocone::v4l2

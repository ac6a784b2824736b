// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/v4l2_camera/kernel.h"
#include "hal/camera.h"

/// Cameras of the kernel's Video4Linux2 interface, streamed through memory that device and program share.
namespace twocone::v4l2 {

/// The reason why this build has no such cameras: it was made without the kernel's headers for video devices, and
/// opening returns kUnavailable. Empty: the build has the driver.
std::string_view why_not();

/// A control and its value. The name is the one that `v4l2-ctl --list-ctrls` prints: exposure_time_absolute, gain.
using Control = std::pair<std::string, std::int64_t>;

struct V4l2Settings {
  /// A path (/dev/video0), a link to it (/dev/v4l/by-id/..., by-path/...), or the card's name, if only one has it.
  std::string device;
  /// YUYV, UYVY, NV12, GREY, RGB3, BGR3 or MJPG; empty: the first of these that the camera has in the requested size.
  std::string format;
  /// Controls are set in this order, which matters: exposure_time_absolute is refused until auto_exposure allows it. A
  /// button is pressed with any value.
  std::vector<Control> controls;
};

/// @throws std::invalid_argument naming every bad field
void check(const V4l2Settings& settings);

/// A camera of this machine, as `twocone devices` lists it.
struct CameraInfo {
  std::string path;         ///< /dev/video0; may change when the camera is plugged in again
  std::string stable_path;  ///< /dev/v4l/by-id/... or by-path/...; empty: it has none
  std::string card;
  std::string bus;
  std::vector<std::string> modes;  ///< "YUYV 640x480 at 30, 15 Hz"; also formats that the driver does not support
};
std::vector<CameraInfo> list_cameras(const std::shared_ptr<Kernel>& kernel = real_kernel());

/// The path, with all links resolved, of the device that V4l2Settings::device names; `device` itself if there is none.
std::string node_of(const std::string& device, const std::shared_ptr<Kernel>& kernel = real_kernel());

/// A camera of Video4Linux2. Frames are in the camera's own format, and lent: a frame's buffer goes back to the device
/// when the last copy of the frame is destroyed. If too few buffers are left for the device, or if its rows are padded,
/// frames are copies instead.
///
/// Capture times are the kernel's, of the same clock as std::chrono::steady_clock. For most cameras this is the moment
/// at which the frame's first byte arrived, which is after the exposure. If a device's times are not of that clock, the
/// capture time is the time at which the program took the frame.
///
/// facts() holds the controls as read back from the device.
///
/// Frames that outlive stop(), an unplug or the camera keep their pixels, and do not keep the device open.
///
/// A damaged frame is reported once (kBadData) and counts as lost; the stream continues. After kDisconnected, stop()
/// and configure() search for the device again; while it is missing, configure() returns kDisconnected again. Whatever
/// its timeout, grab() waits at most ten frame periods, or half a second if that is longer (three seconds for the first
/// frame): a camera that sends nothing is reported (kTimeout). So is a camera whose source is cut off, although it
/// still sends. When the source is back, grab() returns kDisconnected, because the image size may have changed.
class V4l2Camera final : public Camera {
 public:
  /// Opens the device. Errors: kNotFound, kRefused (no permission; no camera; several cards of that name),
  /// kUnavailable.
  /// @throws std::invalid_argument as check() does
  static Result<std::unique_ptr<V4l2Camera>> open(const V4l2Settings& settings,
                                                  std::shared_ptr<Kernel> kernel = real_kernel());
  ~V4l2Camera() override;

 private:
  class Impl;
  explicit V4l2Camera(std::unique_ptr<Impl> impl);

  Result<CameraSettings> do_configure(const CameraSettings& wanted) override;
  Status do_start() override;
  Result<Frame> do_grab(std::chrono::milliseconds timeout) override;
  void do_stop() noexcept override;
  void do_tell(CameraFacts& facts) const override;

  std::unique_ptr<Impl> impl_;
};

}  // namespace twocone::v4l2

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

/// The kernel's video devices (Video4Linux2), streamed through memory that device and program share.
namespace twocone::v4l2 {

/// Why this build cannot, where it was made without the kernel's headers of video devices: opening is then
/// kUnavailable. Empty: it can.
std::string_view why_not();

/// A control and its value, by the name that `v4l2-ctl --list-ctrls` prints: exposure_time_absolute, gain.
using Control = std::pair<std::string, std::int64_t>;

struct V4l2Settings {
  /// A path (/dev/video0), a link to it (/dev/v4l/by-id/..., by-path/...), or the card's name, if only one has it.
  std::string device;
  /// YUYV, UYVY, NV12, GREY, RGB3, BGR3 or MJPG; empty: the first of these that the camera has in the size asked for.
  std::string format;
  /// Set in this order, which matters: exposure_time_absolute is refused until auto_exposure allows it. A button is
  /// pressed, whatever its value.
  std::vector<Control> controls;
};

/// @throws std::invalid_argument naming every bad field
void check(const V4l2Settings& settings);

/// A camera of this machine, as `twocone devices` lists it.
struct CameraInfo {
  std::string path;         ///< /dev/video0: may be another one after the next plugging in
  std::string stable_path;  ///< /dev/v4l/by-id/... or by-path/...; empty: it has none
  std::string card;
  std::string bus;
  std::vector<std::string> modes;  ///< "YUYV 640x480 at 30, 15 Hz"; formats that the driver does not know are named too
};
std::vector<CameraInfo> list_cameras(const std::shared_ptr<Kernel>& kernel = real_kernel());

/// The path, behind all links, of the device that V4l2Settings::device means; `device` itself where there is none.
std::string node_of(const std::string& device, const std::shared_ptr<Kernel>& kernel = real_kernel());

/// Frames are in the camera's own format, and lent: their buffer goes back to the device when the last copy of the
/// frame is gone. Where too few buffers are left for the device, or its rows are padded, frames are copies instead.
///
/// Capture times are the kernel's, of the same clock as std::chrono::steady_clock: for most cameras the moment at which
/// the frame's first byte came, which is after the exposure. A device whose times are of no such clock gets the time at
/// which the program took the frame.
///
/// facts(): the controls as read back from the device.
///
/// Frames that outlive stop(), an unplug or the camera keep their pixels, and do not keep the device open.
///
/// A damaged frame is told of once (kBadData) and counts as lost; the stream goes on. After kDisconnected, stop() and
/// configure() look for the device anew; while it is not there, configure() is kDisconnected again. grab() waits no
/// longer than ten frame periods, and at least half a second (three seconds for the first frame), whatever it is asked
/// for: a camera that sends nothing is told of (kTimeout). So is one whose source is cut off, though it sends on; when
/// the source is back, the stream is kDisconnected, for it may be of another size.
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

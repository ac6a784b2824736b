// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/image.h"
#include "hal/result.h"

namespace twocone {

struct CameraSettings {
  int width_px = 640;
  int height_px = 480;
  double rate_hz = 15;

  friend bool operator==(const CameraSettings&, const CameraSettings&) = default;
};

/// @throws std::invalid_argument naming every field that is not positive and finite.
void check(const CameraSettings& settings);

/// A description of a camera and of the settings that it applied, for a person and for records.
struct CameraFacts {
  CameraSettings settings;  ///< as applied
  bool has_rate = true;     ///< false: the device does not report its rate; `settings.rate_hz` is the requested one
  std::string device;       ///< model and place: "vivid (/dev/video0)"; empty: no device
  std::string format;       ///< pixel format by the driver's name; empty: no device
  /// Names and values as read back from the device, in the order in which they were set.
  std::vector<std::pair<std::string, double>> controls;
};

/// A source of images, real or rendered.
///
///     kClosed --configure--> kConfigured --start--> kStreaming
///                             ^  |   ^                  |
///                             +--+   +------stop--------+
///
/// To write a backend, derive from this class, implement the four private virtual functions, and add a case beside
/// tests/drivers/memory_conformance_test.cpp. The public calls check state and arguments, so a backend need not.
/// A camera must be used by one thread at a time.
class Camera {
 public:
  enum class State { kClosed, kConfigured, kStreaming };

  /// A backend's own destructor must end the stream, because its do_stop() no longer exists here.
  virtual ~Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  /// Applies `settings`, or the nearest ones that the device has, and returns the applied settings. Allowed in kClosed,
  /// kConfigured. Errors: kInvalidState, kUnavailable, kDisconnected, kRefused. @throws std::invalid_argument as
  /// check() does.
  Result<CameraSettings> configure(const CameraSettings& settings);

  /// Begins the stream. Allowed in kConfigured. Errors: kInvalidState, kUnavailable, kDisconnected, kRefused.
  Status start();

  /// Returns the newest frame that was not returned before. Waits for it at most `timeout`, and never longer than
  /// kLongestWait. Allowed in kStreaming.
  /// Errors: kInvalidState, kTimeout, kDisconnected, kBadData. @throws std::invalid_argument for a negative timeout.
  Result<Frame> grab(std::chrono::milliseconds timeout);

  /// Ends the stream. Allowed always; afterwards a streaming camera is kConfigured.
  void stop() noexcept;

  [[nodiscard]] State state() const { return state_; }
  /// Describes the camera once it is configured; before that, the fields have their defaults.
  [[nodiscard]] CameraFacts facts() const;

 protected:
  Camera() = default;

 private:
  virtual Result<CameraSettings> do_configure(const CameraSettings& wanted) = 0;
  virtual Status do_start() = 0;
  virtual Result<Frame> do_grab(std::chrono::milliseconds timeout) = 0;
  virtual void do_stop() noexcept = 0;
  /// Fills in the facts that only the driver knows; `settings` is filled in already.
  virtual void do_facts(CameraFacts&) const {}

  CameraSettings applied_{};
  State state_ = State::kClosed;
};

/// Configures and starts a camera. A camera that applies another size than the wanted one is refused, because the
/// calibration holds for one size.
/// Errors: kRefused and those of Camera::configure and Camera::start, with `name` before them.
Status start_camera(const std::string& name, Camera& camera, const CameraSettings& wanted);

/// V4L2's names of the pixel formats that drivers for real cameras support, in the order in which they are tried.
constexpr std::array<std::string_view, 7> kCameraFormats{"YUYV", "UYVY", "NV12", "RGB3", "BGR3", "MJPG", "GREY"};

/// A real camera, and how it is to be used.
struct CameraDevice {
  std::string name;    ///< the name by which its driver identifies the camera
  std::string format;  ///< one of kCameraFormats; empty: the driver chooses
  /// Names and values by the driver's own naming, set in this order.
  std::vector<std::pair<std::string, double>> controls{};

  friend bool operator==(const CameraDevice&, const CameraDevice&) = default;
};

/// @throws std::invalid_argument naming every bad field, after `settings`, the settings' name in the message
void check(const CameraDevice& device, std::string_view settings);

}  // namespace twocone

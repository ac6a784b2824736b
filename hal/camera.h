// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "hal/frame.h"
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

/// What a camera is and what it made of its settings, for a person and for records.
struct CameraFacts {
  CameraSettings settings;  ///< as applied
  bool rate_told = true;    ///< else the device does not tell, and `settings.rate_hz` is what was asked for
  std::string device;       ///< model and place: "vivid (/dev/video0)"; empty: no device
  std::string format;       ///< of its pixels, by the driver's name; empty: no device
  /// As read back from the device, in the order in which they were set.
  std::vector<std::pair<std::string, double>> controls;
};

/// A source of pictures, real or rendered.
///
///     kClosed --configure--> kConfigured --start--> kStreaming
///                             ^  |   ^                  |
///                             +--+   +------stop--------+
///
/// To write a backend, derive, fill in the four private virtuals, and add a case beside
/// tests/drivers/memory_conformance_test.cpp; the public calls check state and arguments, so that a backend need not.
/// One thread at a time.
class Camera {
 public:
  enum class State { kClosed, kConfigured, kStreaming };

  /// A backend's own destructor must end the stream: here, its do_stop() is already gone.
  virtual ~Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  /// Applies `settings` or the nearest that the device has, and returns what was applied. Allowed in kClosed,
  /// kConfigured. Errors: kInvalidState, kUnavailable, kDisconnected, kRefused. @throws std::invalid_argument as
  /// check() does.
  Result<CameraSettings> configure(const CameraSettings& settings);

  /// Begins the stream. Allowed in kConfigured. Errors: kInvalidState, kUnavailable, kDisconnected, kRefused.
  Status start();

  /// The newest exposure not handed out before; waits at most `timeout` for it, and never longer than
  /// kLongestWait. Allowed in kStreaming.
  /// Errors: kInvalidState, kTimeout, kDisconnected, kBadData. @throws std::invalid_argument for a negative timeout.
  Result<Frame> grab(std::chrono::milliseconds timeout);

  /// Ends the stream. Allowed always; afterwards a streaming camera is kConfigured.
  void stop() noexcept;

  [[nodiscard]] State state() const { return state_; }
  /// Of a camera that was configured; before that, defaults.
  [[nodiscard]] CameraFacts facts() const;

 protected:
  Camera() = default;

 private:
  virtual Result<CameraSettings> do_configure(const CameraSettings& wanted) = 0;
  virtual Status do_start() = 0;
  virtual Result<Frame> do_grab(std::chrono::milliseconds timeout) = 0;
  virtual void do_stop() noexcept = 0;
  /// Fills in what the driver knows beside `settings`.
  virtual void do_tell(CameraFacts&) const {}

  CameraSettings applied_{};
  State state_ = State::kClosed;
};

}  // namespace twocone

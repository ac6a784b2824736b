// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "hal/clock.h"
#include "hal/result.h"

namespace twocone {

/// Angular speeds of the two wheels; positive drives forward.
struct WheelSpeeds {
  double left_radps = 0;
  double right_radps = 0;

  friend bool operator==(const WheelSpeeds&, const WheelSpeeds&) = default;
};

/// Angles that the wheels have turned since the drive was opened, as the encoders measure them; they do not wrap.
struct WheelAngles {
  Timestamp time;
  double left_rad = 0;
  double right_rad = 0;
};

struct DriveLimits {
  double max_speed_radps = 10;                            ///< of either wheel, > 0
  std::chrono::nanoseconds command_timeout{500'000'000};  ///< dead-man time, > 0
};

/// @throws std::invalid_argument naming every field that is not positive and finite.
void check(const DriveLimits& limits);

/// A description of a drive, for a person and for records.
struct DriveFacts {
  std::string device;          ///< "/dev/ttyUSB0 at 57600 baud"; empty: no device
  std::string controller;      ///< kind and version, as it reports them; empty: no device
  double counts_per_turn = 0;  ///< encoder counts per turn of a wheel; 0: the angles do not come from counts
  /// Time without a command after which the controller itself stops the wheels; none: it never does.
  std::optional<std::chrono::milliseconds> own_timeout;
  bool has_watchdog = false;  ///< a second process stops the wheels if this one cannot
};

/// Two wheels on one axle.
///
/// Every backend keeps the dead-man rule, which tests/drivers/diff_drive_conformance_test.cpp checks: if set_speeds()
/// was not called for `command_timeout`, the wheels stop by themselves. They also stop on stop() and when the drive is
/// destroyed. To write a backend, derive from this class, implement the three private virtual functions and the
/// destructor, and add the backend to that suite.
class DiffDrive {
 public:
  /// A backend's own destructor must stop the wheels, because its do_stop() no longer exists here.
  virtual ~DiffDrive() = default;
  DiffDrive(const DiffDrive&) = delete;
  DiffDrive& operator=(const DiffDrive&) = delete;

  /// Sets both speeds and returns the applied ones. If a wheel would exceed the limit, both are scaled by one factor,
  /// which keeps the path's curvature. Errors: kTimeout, kDisconnected, kBadData, kRefused, kUnavailable.
  /// @throws std::invalid_argument for a speed that is not finite.
  Result<WheelSpeeds> set_speeds(const WheelSpeeds& wanted);

  /// Returns the newest angles. Errors: kTimeout, kDisconnected, kBadData, kUnavailable.
  Result<WheelAngles> read_angles() { return do_read_angles(); }

  /// Stops the wheels now. An error means that the device did not get the command; the dead-man rule then stops them.
  Status stop() noexcept { return do_stop(); }

  [[nodiscard]] const DriveLimits& limits() const { return limits_; }
  [[nodiscard]] DriveFacts facts() const { return do_facts(); }

 protected:
  /// @throws std::invalid_argument as check() does.
  explicit DiffDrive(const DriveLimits& limits);

 private:
  virtual Status do_set_speeds(const WheelSpeeds& speeds) = 0;
  virtual Result<WheelAngles> do_read_angles() = 0;
  virtual Status do_stop() noexcept = 0;
  [[nodiscard]] virtual DriveFacts do_facts() const { return {}; }

  DriveLimits limits_;
};

}  // namespace twocone

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/serial_diffdrive/transport.h"
#include "hal/result.h"

struct sp_port;

namespace twocone::serial {

/// A serial port of this machine, as `twocone devices` lists it.
struct PortInfo {
  std::string path;         ///< /dev/ttyUSB0; may change when the device is plugged in again
  std::string stable_path;  ///< /dev/serial/by-id/...; empty: it has none
  std::string description;  ///< maker, product, serial number, as far as they are reported
};
std::vector<PortInfo> list_ports();

/// A port that only this program uses (by TIOCEXCL, and by a lock that also excludes root's other programs).
class SerialPort final : public Transport {
 public:
  /// Opens a port. If it is busy, waits briefly for the watchdog of a program that just ended.
  /// @param path of the port or of a link to it
  /// Errors: kNotFound (no such port), kRefused (another program has it, no permission, not a serial port, no such
  /// rate), kUnavailable.
  static Result<std::unique_ptr<SerialPort>> open(const std::string& path, int baud);
  ~SerialPort() override;

  Status write(std::span<const std::uint8_t> bytes, Deadline deadline) override;
  Result<std::size_t> read(std::span<std::uint8_t> room, Deadline deadline) override;
  Status discard_input() override;

  /// The kernel's descriptor, open as long as this object exists.
  [[nodiscard]] int descriptor() const { return descriptor_; }

 private:
  SerialPort(std::string path, sp_port* port, int descriptor)
      : path_(std::move(path)), port_(port), descriptor_(descriptor) {}

  static Result<std::unique_ptr<SerialPort>> open_once(const std::string& path, int baud, bool& is_busy);
  Status take_alone(bool& is_busy);
  Status set_up(int baud);
  [[nodiscard]] Error gone() const;
  /// Waits for `events`. Errors: kTimeout, kDisconnected.
  [[nodiscard]] Status wait_for(short events, Deadline deadline) const;

  const std::string path_;
  sp_port* const port_;
  const int descriptor_;
  bool is_alone_ = false;
};

}  // namespace twocone::serial

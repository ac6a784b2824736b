// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "drivers/serial_diffdrive/serial_diffdrive.h"
#include "tests/emulator/fd_bench.h"

namespace twocone::emulator {

/// An emulator that can be unplugged and plugged in again.
class Plug {
 public:
  explicit Plug(std::string protocol) : protocol_(std::move(protocol)) { plug_in(); }
  ~Plug() { unplug(); }
  void plug_in() {
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends_) != 0) throw std::runtime_error("no socket");
    server_ = std::make_unique<Server>(protocol_, ends_[1]);
  }
  void unplug() {
    if (!server_) return;
    server_.reset();
    ::close(ends_[1]);
    if (!taken_) ::close(ends_[0]);
    taken_ = false;
  }
  /// Its transport can be opened once, until it is plugged in again.
  serial::Machine machine() {
    return {.connect = [this]() -> Result<serial::Connection> {
      if (!server_ || taken_) return Error{ErrorCode::kNotFound, "there is no such port"};
      taken_ = true;
      return serial::Connection{std::make_unique<DescriptorTransport>(ends_[0]), ends_[0]};
    }};
  }
  /// Like machine(), but the transport may be opened again while its far end exists.
  serial::Machine machine_again() {
    return {.connect = [this]() -> Result<serial::Connection> {
      const int copy = ::fcntl(ends_[0], F_DUPFD_CLOEXEC, 0);
      if (copy < 0) return Error{ErrorCode::kNotFound, "there is no such port"};
      return serial::Connection{std::make_unique<DescriptorTransport>(copy), copy};
    }};
  }
  Server& server() { return *server_; }

  /// The settings that the robot file would contain.
  [[nodiscard]] serial::SerialDriveSettings settings(double counts_per_turn) const {
    serial::SerialDriveSettings settings;
    settings.port = "the emulator";
    settings.protocol = protocol_;
    if (protocol_ != "create2") settings.counts_per_turn = counts_per_turn;
    return settings;
  }

 private:
  const std::string protocol_;
  int ends_[2]{-1, -1};
  std::unique_ptr<Server> server_;
  bool taken_ = false;
};

}  // namespace twocone::emulator

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <string>

#include "drivers/serial_diffdrive/transport.h"

namespace twocone::serial {

/// A transport that keeps the first bytes received, for a message to a user who connected another device than the
/// configured one.
class MonitoredTransport final : public Transport {
 public:
  explicit MonitoredTransport(Transport& transport) : transport_(transport) {}

  [[nodiscard]] Deadline now() const override { return transport_.now(); }
  Status write(std::span<const std::uint8_t> bytes, Deadline deadline) override {
    return transport_.write(bytes, deadline);
  }
  Result<std::size_t> read(std::span<std::uint8_t> room, Deadline deadline) override {
    auto got = transport_.read(room, deadline);
    if (got) note(room.first(*got));
    return got;
  }
  Status discard_input() override {
    std::array<std::uint8_t, 256> room;
    // The number of rounds is limited, because a device that never pauses would keep the program here.
    for (int i = 0; i < 16; ++i) {
      const auto got = transport_.read(room, transport_.now());
      if (!got) break;
      note(std::span(room).first(*got));
    }
    return transport_.discard_input();
  }
  void pause(std::chrono::milliseconds time) override { transport_.pause(time); }

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] const std::string& beginning() const { return beginning_; }

 private:
  static constexpr std::size_t kKept = 60;

  void note(std::span<const std::uint8_t> bytes) {
    count_ += bytes.size();
    const auto some = bytes.first(std::min(bytes.size(), kKept - beginning_.size()));
    beginning_.append(some.begin(), some.end());
  }

  Transport& transport_;
  std::size_t count_ = 0;
  std::string beginning_;
};

}  // namespace twocone::serial

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <string>

#include "drivers/serial_diffdrive/wire.h"

namespace twocone::serial {

/// A wire that remembers the beginning of what came, for the person who connected another device than the program was
/// told of.
class ListeningWire final : public Wire {
 public:
  explicit ListeningWire(Wire& wire) : wire_(wire) {}

  [[nodiscard]] Deadline now() const override { return wire_.now(); }
  Status write(std::span<const std::uint8_t> bytes, Deadline deadline) override { return wire_.write(bytes, deadline); }
  Result<std::size_t> read(std::span<std::uint8_t> room, Deadline deadline) override {
    auto got = wire_.read(room, deadline);
    if (got) note(room.first(*got));
    return got;
  }
  Status discard_input() override {
    std::array<std::uint8_t, 256> room;
    // A device that never pauses would keep it here: some rounds are enough to know it.
    for (int i = 0; i < 16; ++i) {
      const auto got = wire_.read(room, wire_.now());
      if (!got) break;
      note(std::span(room).first(*got));
    }
    return wire_.discard_input();
  }
  void pause(std::chrono::milliseconds time) override { wire_.pause(time); }

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] const std::string& beginning() const { return beginning_; }

 private:
  static constexpr std::size_t kKept = 60;

  void note(std::span<const std::uint8_t> bytes) {
    count_ += bytes.size();
    const auto some = bytes.first(std::min(bytes.size(), kKept - beginning_.size()));
    beginning_.append(some.begin(), some.end());
  }

  Wire& wire_;
  std::size_t count_ = 0;
  std::string beginning_;
};

}  // namespace twocone::serial

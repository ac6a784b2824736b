// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "drivers/serial_diffdrive/protocol.h"

namespace twocone::serial {

/// Whole counts of both wheels since the beginning.
struct WheelCounts {
  std::int64_t left = 0;
  std::int64_t right = 0;
};

/// Makes counts that do not wrap from a controller's counts, which wrap at 16 or 32 bits. The result is correct as long
/// as the counts change by less than half of their range between two readings.
class WheelCounter {
 public:
  /// @param bits 16 or 32
  explicit WheelCounter(int bits) : bits_(bits) {}

  /// The counts of both wheels since the last reading, if the controller was not reset in between; zero for the first
  /// reading after rebase().
  [[nodiscard]] WheelCounts step_to(const RawCounts& raw) const {
    if (!last_) return {};
    return {difference(raw.left, last_->left), difference(raw.right, last_->right)};
  }
  /// Adds a reading to the total.
  void advance(const RawCounts& raw) {
    const WheelCounts step = step_to(raw);
    total_.left += step.left;
    total_.right += step.right;
    last_ = raw;
  }
  /// Makes the next reading equal to the last total. Call it after a reset, or for another controller.
  void rebase() { last_.reset(); }

  [[nodiscard]] const WheelCounts& total() const { return total_; }

 private:
  [[nodiscard]] std::int64_t difference(std::uint32_t to, std::uint32_t from) const {
    const std::uint32_t apart = to - from;
    return bits_ == 16 ? std::int64_t(std::int16_t(std::uint16_t(apart))) : std::int64_t(std::int32_t(apart));
  }

  int bits_;
  std::optional<RawCounts> last_;
  WheelCounts total_;
};

}  // namespace twocone::serial

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "apps/import/messages.h"

namespace twocone::importer {

/// Writes the fields of a message of ROS as its own programs do.
class RosMessage {
 public:
  explicit RosMessage(Encoding encoding, bool is_big_endian = false)
      : is_aligned_(encoding == Encoding::kCdr), is_big_endian_(is_big_endian) {
    if (is_aligned_) bytes_.assign({'\0', is_big_endian ? '\0' : '\1', '\0', '\0'});
  }

  template <typename Number>
  RosMessage& number(Number value) {
    constexpr std::size_t kHead = 4;
    while (is_aligned_ && (bytes_.size() - kHead) % sizeof value != 0) bytes_ += '\0';
    auto raw = std::bit_cast<std::array<char, sizeof value>>(value);
    if (is_big_endian_) std::ranges::reverse(raw);
    bytes_.append(raw.data(), raw.size());
    return *this;
  }
  RosMessage& text(const std::string& text) {
    number(std::uint32_t(text.size() + (is_aligned_ ? 1 : 0)));
    bytes_ += text;
    if (is_aligned_) bytes_ += '\0';
    return *this;
  }
  RosMessage& data(const std::string& data) {
    number(std::uint32_t(data.size()));
    bytes_ += data;
    return *this;
  }
  RosMessage& header(std::uint32_t seconds, std::uint32_t nanoseconds, const std::string& frame) {
    if (!is_aligned_) number(std::uint32_t{7});
    return number(seconds).number(nanoseconds).text(frame);
  }
  [[nodiscard]] const std::string& raw() const { return bytes_; }
  [[nodiscard]] std::span<const std::byte> bytes() const { return std::as_bytes(std::span(bytes_)); }

 private:
  std::string bytes_;
  bool is_aligned_, is_big_endian_;
};

}  // namespace twocone::importer

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

/// Records of MCAP: a byte that names the kind, the length as 64 bits, and the content. Numbers are little-endian.
namespace twocone::mcap {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are in memory");

enum class Kind : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
/// Bytes before a record's content.
inline constexpr std::size_t kRecordHead = 9;

/// The content of a record that is being written.
class Content {
 public:
  template <std::integral Number>
  Content& number(Number value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  Content& text(std::string_view text) { return number(std::uint32_t(text.size())).raw(text); }
  Content& raw(std::string_view bytes) {
    bytes_.append(bytes);
    return *this;
  }
  Content& texts(const std::map<std::string, std::string>& texts) {
    Content inside;
    for (const auto& [key, value] : texts) inside.text(key).text(value);
    return text(inside.bytes_);
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  /// Returns the whole record.
  [[nodiscard]] std::string record(Kind kind) const {
    Content whole;
    whole.number(std::uint8_t(kind)).number(std::uint64_t(bytes_.size())).raw(bytes_);
    return std::move(whole.bytes_);
  }

 private:
  std::string bytes_;
};

/// Reads a record's content. After a read beyond its end, it has failed, and all further values are empty.
class Fields {
 public:
  explicit Fields(std::span<const std::byte> bytes) : left_(bytes) {}

  template <std::integral Number>
  Number number() {
    Number value{};
    const auto from = raw(sizeof value);
    if (!has_failed_) std::memcpy(&value, from.data(), sizeof value);
    return value;
  }
  std::string text() {
    const auto from = raw(number<std::uint32_t>());
    return {reinterpret_cast<const char*>(from.data()), from.size()};
  }
  std::span<const std::byte> raw(std::uint64_t size) {
    if (has_failed_ || size > left_.size()) {
      has_failed_ = true;
      return {};
    }
    const auto taken = left_.first(size);
    left_ = left_.subspan(size);
    return taken;
  }
  std::span<const std::byte> rest() { return raw(left_.size()); }
  std::map<std::string, std::string> texts() {
    std::map<std::string, std::string> result;
    Fields inside(raw(number<std::uint32_t>()));
    while (!inside.left_.empty() && !inside.has_failed_) {
      std::string key = inside.text();
      result[std::move(key)] = inside.text();
    }
    has_failed_ = has_failed_ || inside.has_failed_;
    return result;
  }
  [[nodiscard]] bool has_failed() const { return has_failed_; }

 private:
  std::span<const std::byte> left_;
  bool has_failed_ = false;
};

}  // namespace twocone::mcap

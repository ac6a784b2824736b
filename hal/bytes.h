// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace twocone {

/// The bytes of an image: its own, or lent by a driver. A lent buffer goes back to the device when the last copy of the
/// image is destroyed. Reading never copies. A call that is not const could write, so it first replaces lent bytes by a
/// copy that the image owns.
class Bytes {
 public:
  using value_type = std::uint8_t;

  Bytes() = default;
  Bytes(std::vector<std::uint8_t> own) : own_(std::move(own)) {}  // NOLINT(google-explicit-constructor)
  Bytes(std::initializer_list<std::uint8_t> own) : own_(own) {}
  template <std::input_iterator From>
  Bytes(From begin, From end) : own_(begin, end) {}
  /// @param lender keeps `bytes` valid and unchanged until the last copy releases it
  static Bytes lent(std::span<const std::uint8_t> bytes, std::shared_ptr<const void> lender) {
    Bytes result;
    result.lent_ = bytes;
    result.lender_ = std::move(lender);
    return result;
  }

  [[nodiscard]] bool is_lent() const { return lender_ != nullptr; }
  [[nodiscard]] const std::uint8_t* data() const { return lender_ ? lent_.data() : own_.data(); }
  [[nodiscard]] std::size_t size() const { return lender_ ? lent_.size() : own_.size(); }
  [[nodiscard]] bool empty() const { return size() == 0; }
  [[nodiscard]] const std::uint8_t* begin() const { return data(); }
  [[nodiscard]] const std::uint8_t* end() const { return data() + size(); }
  const std::uint8_t& operator[](std::size_t i) const { return data()[i]; }

  std::uint8_t* data() { return own().data(); }
  std::uint8_t* begin() { return own().data(); }
  std::uint8_t* end() { return own().data() + own_.size(); }
  std::uint8_t& operator[](std::size_t i) { return own()[i]; }
  void resize(std::size_t size) { own().resize(size); }
  void push_back(std::uint8_t byte) { own().push_back(byte); }
  template <std::input_iterator From>
  void assign(From begin, From end) {
    *this = Bytes(begin, end);
  }

  friend bool operator==(const Bytes& a, const Bytes& b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); }

 private:
  std::vector<std::uint8_t>& own() {
    if (lender_) {
      own_.assign(lent_.begin(), lent_.end());
      lender_.reset();
      lent_ = {};
    }
    return own_;
  }

  std::vector<std::uint8_t> own_;
  std::span<const std::uint8_t> lent_;
  std::shared_ptr<const void> lender_;
};

}  // namespace twocone

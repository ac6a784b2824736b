// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <future>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/clock.h"
#include "hal/result.h"

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

/// The layout of an image's pixels. All have 8 bits per channel, coded as cameras deliver them (not linear light).
enum class PixelFormat {
  kRgb8,
  kBgr8,
  kGrey8,
  kYuyv,   ///< Y0 U Y1 V: two pixels in four bytes; even width. Y, U and V by ITU-R BT.601, Y from 16 to 235
  kUyvy,   ///< U Y0 V Y1
  kNv12,   ///< all Y, then U V for each 2 x 2 pixels; even width and height
  kMjpeg,  ///< one JPEG image
};

std::string_view to_string(PixelFormat format);

/// Returns the number of bytes of a whole image; nothing if it depends on the content (kMjpeg), or if the format cannot
/// have this size.
std::optional<std::size_t> image_bytes(PixelFormat format, int width_px, int height_px);

/// Pixels of one image, rows from the top, no padding between rows. Point (0, 0) is the centre of the first pixel.
struct Image {
  int width_px = 0;
  int height_px = 0;
  PixelFormat format = PixelFormat::kRgb8;
  Bytes bytes;  ///< image_bytes() bytes

  friend bool operator==(const Image&, const Image&) = default;
};

/// Converts an image to kRgb8. The consumer calls this; no driver converts by itself. From Y, U and V, the result is
/// within 1 of the rounded result of BT.601's equations; the two or four pixels that share U and V use the same values
/// (tests/hal/yuv_test.cpp).
/// Errors: kBadData if the size of `image.bytes` does not match width, height and format, or if a JPEG image is
/// truncated, damaged, or of another size.
Result<Image> to_rgb8(const Image& image);

/// Compresses an image to kMjpeg, with one colour value for each two pixels of a row (4:2:2), as USB cameras do.
/// @param quality of libjpeg, 1 to 100. Errors: those of to_rgb8; kUnavailable (no memory).
Result<Image> to_mjpeg(const Image& image, int quality);

/// The pixels, which may have several readers, or the reason why there are none.
using ImageResult = Result<std::shared_ptr<const Image>>;

/// Returns a future that already holds the image or the error.
std::shared_future<ImageResult> ready_image(ImageResult image);

/// One image of one camera. A copy is cheap, because copies share the pixels.
///
/// The pixels may arrive after the frame: a simulation renders in the background. On hardware they are already present.
class Frame {
 public:
  struct Header {
    /// Number of the exposure, lost exposures included; may start again from its first value at start().
    std::uint64_t sequence = 0;
    Timestamp captured;                ///< middle of the exposure, as well as the backend knows it
    std::uint64_t lost_before = 0;     ///< exposures lost since the previous frame that was returned
    std::uint64_t skipped_before = 0;  ///< how many of them had arrived, but were skipped for a newer one
  };

  Frame(Header header, std::shared_future<ImageResult> pixels) : header_(header), pixels_(std::move(pixels)) {}
  /// Makes a frame whose pixels are already present.
  Frame(Header header, Image image) : Frame(header, ready_image(std::make_shared<const Image>(std::move(image)))) {}

  [[nodiscard]] const Header& header() const { return header_; }

  /// Waits for the pixels at most `timeout` and at most kLongestWait. It may be called again and from several threads.
  /// Errors: kTimeout (not yet arrived), or the backend's error: kUnavailable, kDisconnected, kBadData, kRefused.
  [[nodiscard]] ImageResult image(std::chrono::milliseconds timeout) const;

 private:
  Header header_;
  std::shared_future<ImageResult> pixels_;
};

}  // namespace twocone

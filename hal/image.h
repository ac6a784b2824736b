// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "hal/bytes.h"
#include "hal/result.h"

namespace twocone {

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

/// The number of bytes of a whole image. Nothing if it depends on the content (kMjpeg), or if the format cannot have
/// this size.
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

}  // namespace twocone

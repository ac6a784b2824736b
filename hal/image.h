// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "hal/bytes.h"
#include "hal/result.h"

namespace twocone {

/// How a picture's pixels are laid out. All are 8 bits a channel, coded as cameras deliver them (not linear light).
enum class PixelFormat {
  kRgb8,
  kBgr8,
  kGrey8,
  kYuyv,   ///< Y0 U Y1 V: two pixels in four bytes; an even width. Y, U and V as ITU-R BT.601 says, Y from 16 to 235
  kUyvy,   ///< U Y0 V Y1
  kNv12,   ///< all Y, then U V for each 2 x 2 pixels; an even width and height
  kMjpeg,  ///< one JPEG picture
};

std::string_view to_string(PixelFormat format);

/// The bytes of a whole picture; nothing where they depend on what it shows (kMjpeg), or for sides that the format
/// cannot have.
std::optional<std::size_t> picture_bytes(PixelFormat format, int width_px, int height_px);

/// Pixels of one picture, rows from the top, no padding between rows. Pixel (0, 0) is the centre of the first pixel.
struct Image {
  int width_px = 0;
  int height_px = 0;
  PixelFormat format = PixelFormat::kRgb8;
  Bytes bytes;  ///< picture_bytes() of them

  friend bool operator==(const Image&, const Image&) = default;
};

/// The same picture as kRgb8. A consumer calls this; no driver converts on its own. From Y, U and V: within 1 of what
/// BT.601's equations give, rounded; two or four pixels that share U and V have them alike (tests/hal/yuv_test.cpp).
/// Errors: kBadData if `image.bytes` does not hold what width, height and format promise; a JPEG picture that is cut
/// off, damaged, or of another size.
Result<Image> to_rgb8(const Image& image);

}  // namespace twocone

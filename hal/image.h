// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "hal/result.h"

namespace twocone {

/// Layout of one pixel. All are 8 bits a channel, sRGB-coded as cameras deliver them (not linear light).
enum class PixelFormat { kRgb8, kBgr8, kGrey8 };

std::string_view to_string(PixelFormat format);
int bytes_per_pixel(PixelFormat format);

/// Pixels of one picture, rows from the top, no padding between rows. Pixel (0, 0) is the centre of the first pixel.
struct Image {
  int width_px = 0;
  int height_px = 0;
  PixelFormat format = PixelFormat::kRgb8;
  std::vector<std::uint8_t> bytes;  ///< width_px * height_px * bytes_per_pixel(format)

  friend bool operator==(const Image&, const Image&) = default;
};

/// The same picture as kRgb8. A consumer calls this; no driver converts on its own.
/// Errors: kBadData if `image.bytes` does not hold what width, height and format promise.
Result<Image> to_rgb8(const Image& image);

}  // namespace twocone

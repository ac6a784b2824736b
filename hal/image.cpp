// SPDX-License-Identifier: Apache-2.0
#include "hal/image.h"

#include <cassert>

#include <fmt/format.h>

namespace twocone {

std::string_view to_string(PixelFormat format) {
  switch (format) {
    case PixelFormat::kRgb8:
      return "rgb8";
    case PixelFormat::kBgr8:
      return "bgr8";
    case PixelFormat::kGrey8:
      return "grey8";
  }
  assert(false);
  return "";
}

int bytes_per_pixel(PixelFormat format) { return format == PixelFormat::kGrey8 ? 1 : 3; }

Result<Image> to_rgb8(const Image& image) {
  const bool sized = image.width_px > 0 && image.height_px > 0;
  const std::size_t pixels = sized ? std::size_t(image.width_px) * std::size_t(image.height_px) : 0;
  if (!sized || image.bytes.size() != pixels * std::size_t(bytes_per_pixel(image.format))) {
    return Error{ErrorCode::kBadData, fmt::format("image of {} x {} {} pixels holds {} bytes", image.width_px,
                                                  image.height_px, to_string(image.format), image.bytes.size())};
  }
  if (image.format == PixelFormat::kRgb8) return image;

  Image rgb{image.width_px, image.height_px, PixelFormat::kRgb8, std::vector<std::uint8_t>(pixels * 3)};
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      rgb.bytes[3 * i + channel] =
          image.format == PixelFormat::kGrey8 ? image.bytes[i] : image.bytes[3 * i + (2 - channel)];
    }
  }
  return rgb;
}

}  // namespace twocone

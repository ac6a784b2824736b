// SPDX-License-Identifier: Apache-2.0
#include "hal/image.h"

#include <turbojpeg.h>

#include <cassert>
#include <memory>
#include <vector>

#include <fmt/format.h>

#include "hal/pixels.h"

namespace twocone {
namespace {

std::vector<std::uint8_t> room_for_rgb8(const Image& image) {
  return std::vector<std::uint8_t>(*image_bytes(PixelFormat::kRgb8, image.width_px, image.height_px));
}

std::vector<std::uint8_t> from_nv12(const Image& image) {
  std::vector<std::uint8_t> rgb = room_for_rgb8(image);
  const auto width = std::size_t(image.width_px);
  const auto height = std::size_t(image.height_px);
  const std::uint8_t* const light = image.bytes.data();
  const std::uint8_t* const colours = light + width * height;
  for (std::size_t row = 0; row < height; ++row) {
    pixels::from_nv12(light + row * width, colours + row / 2 * width, width / 2, rgb.data() + 3 * row * width);
  }
  return rgb;
}

/// Converts layouts in which the rows follow each other without a gap.
template <typename Convert>
std::vector<std::uint8_t> at_one_go(const Image& image, std::size_t count, Convert convert) {
  std::vector<std::uint8_t> rgb = room_for_rgb8(image);
  convert(image.bytes.data(), count, rgb.data());
  return rgb;
}

Error bad_jpeg(const Image& image, const std::string& why) {
  return {ErrorCode::kBadData, fmt::format("JPEG image of {} x {} pixels, {} bytes: {}", image.width_px,
                                           image.height_px, image.bytes.size(), why)};
}

Result<std::vector<std::uint8_t>> from_jpeg(const Image& image) {
  struct Destroy {
    void operator()(void* handle) const { tjDestroy(handle); }
  };
  const std::unique_ptr<void, Destroy> decoder(tjInitDecompress());
  if (!decoder) return Error{ErrorCode::kUnavailable, "no memory for a JPEG decoder"};
  int width = 0, height = 0, sampling = 0, colours = 0;
  if (tjDecompressHeader3(decoder.get(), image.bytes.data(), image.bytes.size(), &width, &height, &sampling,
                          &colours) != 0) {
    return bad_jpeg(image, tjGetErrorStr2(decoder.get()));
  }
  if (width != image.width_px || height != image.height_px) {
    return bad_jpeg(image, fmt::format("it has {} x {} pixels", width, height));
  }
  std::vector<std::uint8_t> rgb = room_for_rgb8(image);
  // A warning means damage, most often a truncated image. The missing part would be grey.
  if (tjDecompress2(decoder.get(), image.bytes.data(), image.bytes.size(), rgb.data(), width, 0, height, TJPF_RGB,
                    TJFLAG_ACCURATEDCT | TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS) != 0) {
    return bad_jpeg(image, tjGetErrorStr2(decoder.get()));
  }
  return rgb;
}

}  // namespace

std::string_view to_string(PixelFormat format) {
  switch (format) {
    case PixelFormat::kRgb8:
      return "rgb8";
    case PixelFormat::kBgr8:
      return "bgr8";
    case PixelFormat::kGrey8:
      return "grey8";
    case PixelFormat::kYuyv:
      return "yuyv";
    case PixelFormat::kUyvy:
      return "uyvy";
    case PixelFormat::kNv12:
      return "nv12";
    case PixelFormat::kMjpeg:
      return "mjpeg";
  }
  assert(false);
  return "";
}

std::optional<std::size_t> image_bytes(PixelFormat format, int width_px, int height_px) {
  if (width_px <= 0 || height_px <= 0) return std::nullopt;
  const std::size_t pixels = std::size_t(width_px) * std::size_t(height_px);
  switch (format) {
    case PixelFormat::kRgb8:
    case PixelFormat::kBgr8:
      return 3 * pixels;
    case PixelFormat::kGrey8:
      return pixels;
    case PixelFormat::kYuyv:
    case PixelFormat::kUyvy:
      return width_px % 2 == 0 ? std::optional(2 * pixels) : std::nullopt;
    case PixelFormat::kNv12:
      return width_px % 2 == 0 && height_px % 2 == 0 ? std::optional(pixels / 2 * 3) : std::nullopt;
    case PixelFormat::kMjpeg:
      return std::nullopt;
  }
  assert(false);
  return std::nullopt;
}

Result<Image> to_rgb8(const Image& image) {
  const bool is_jpeg = image.format == PixelFormat::kMjpeg && image.width_px > 0 && image.height_px > 0;
  if (!is_jpeg && image_bytes(image.format, image.width_px, image.height_px) != image.bytes.size()) {
    return Error{ErrorCode::kBadData, fmt::format("image of {} x {} {} pixels holds {} bytes", image.width_px,
                                                  image.height_px, to_string(image.format), image.bytes.size())};
  }
  const std::size_t count = std::size_t(image.width_px) * std::size_t(image.height_px);
  const auto as_rgb8 = [&](std::vector<std::uint8_t> rgb) {
    return Image{image.width_px, image.height_px, PixelFormat::kRgb8, std::move(rgb)};
  };
  switch (image.format) {
    case PixelFormat::kRgb8:
      return image;
    case PixelFormat::kBgr8:
      return as_rgb8(at_one_go(image, count, pixels::from_bgr8));
    case PixelFormat::kGrey8:
      return as_rgb8(at_one_go(image, count, pixels::from_grey8));
    case PixelFormat::kYuyv:
      return as_rgb8(at_one_go(image, count / 2, pixels::from_yuyv));
    case PixelFormat::kUyvy:
      return as_rgb8(at_one_go(image, count / 2, pixels::from_uyvy));
    case PixelFormat::kNv12:
      return as_rgb8(from_nv12(image));
    case PixelFormat::kMjpeg: {
      auto rgb = from_jpeg(image);
      if (!rgb) return rgb.error();
      return as_rgb8(*std::move(rgb));
    }
  }
  assert(false);
  return Error{ErrorCode::kBadData, ""};
}

}  // namespace twocone

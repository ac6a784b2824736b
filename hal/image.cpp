// SPDX-License-Identifier: Apache-2.0
#include "hal/image.h"

#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <memory>

#include <fmt/format.h>

// By default, Debian's compiler makes code for every x86-64 processor, which has no instruction that interleaves three
// channels. With the instructions of the last ten years' processors, these loops take a third to a half of the time.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define TWOCONE_AND_FOR_NEWER_PROCESSORS __attribute__((target_clones("avx2", "default")))
#else
#define TWOCONE_AND_FOR_NEWER_PROCESSORS
#endif

namespace twocone {
namespace {

using Byte = std::uint8_t;

/// Returns `value` / 256, clamped to 0 ... 255.
[[gnu::always_inline]] inline Byte clipped(int value) { return static_cast<Byte>(std::clamp(value >> 8, 0, 255)); }

/// Converts rows. The luma of pixel i is light[kStep * i]; the chroma of pair i is u[2 * kStep * i] and v[2 * kStep *
/// i]. One loop computes the channels and a second one interleaves them, because a compiler vectorises each of these,
/// but no loop that does both.
template <std::size_t kStep>
[[gnu::always_inline]] inline void from_yuv(const Byte* light, const Byte* u, const Byte* v, std::size_t pairs,
                                            Byte* to) {
  constexpr std::size_t kPairs = 128;
  std::array<Byte, 2 * kPairs> red, green, blue;
  while (pairs > 0) {
    const std::size_t count = std::min(pairs, kPairs);
    for (std::size_t i = 0; i < count; ++i) {
      const int from_u = u[2 * kStep * i] - 128;
      const int from_v = v[2 * kStep * i] - 128;
      for (std::size_t k = 0; k < 2; ++k) {
        const int y = 298 * (light[kStep * (2 * i + k)] - 16) + 128;
        red[2 * i + k] = clipped(y + 409 * from_v);
        green[2 * i + k] = clipped(y - 100 * from_u - 208 * from_v);
        blue[2 * i + k] = clipped(y + 516 * from_u);
      }
    }
    for (std::size_t i = 0; i < 2 * count; ++i) {
      to[3 * i] = red[i];
      to[3 * i + 1] = green[i];
      to[3 * i + 2] = blue[i];
    }
    pairs -= count;
    light += 2 * kStep * count;
    u += 2 * kStep * count;
    v += 2 * kStep * count;
    to += 6 * count;
  }
}

TWOCONE_AND_FOR_NEWER_PROCESSORS
void from_bgr8(const Byte* __restrict from, std::size_t pixels, Byte* __restrict to) {
  for (std::size_t i = 0; i < pixels; ++i) {
    to[3 * i] = from[3 * i + 2];
    to[3 * i + 1] = from[3 * i + 1];
    to[3 * i + 2] = from[3 * i];
  }
}

TWOCONE_AND_FOR_NEWER_PROCESSORS
void from_grey8(const Byte* __restrict from, std::size_t pixels, Byte* __restrict to) {
  for (std::size_t i = 0; i < pixels; ++i) to[3 * i] = to[3 * i + 1] = to[3 * i + 2] = from[i];
}

TWOCONE_AND_FOR_NEWER_PROCESSORS
void from_yuyv(const Byte* __restrict from, std::size_t pairs, Byte* __restrict to) {
  from_yuv<2>(from, from + 1, from + 3, pairs, to);
}

TWOCONE_AND_FOR_NEWER_PROCESSORS
void from_uyvy(const Byte* __restrict from, std::size_t pairs, Byte* __restrict to) {
  from_yuv<2>(from + 1, from, from + 2, pairs, to);
}

TWOCONE_AND_FOR_NEWER_PROCESSORS
void from_nv12(const Byte* __restrict light, const Byte* __restrict colours, std::size_t pairs, Byte* __restrict to) {
  from_yuv<1>(light, colours, colours + 1, pairs, to);
}

Error bad_jpeg(const Image& image, const std::string& why) {
  return Error(ErrorCode::kBadData, "JPEG image of {} x {} pixels, {} bytes: {}", image.width_px, image.height_px,
               image.bytes.size(), why);
}

/// Decodes a JPEG image. @param rgb receives the pixels
Status decode_jpeg(const Image& image, std::uint8_t* rgb) {
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), tjDestroy);
  if (!decoder) return Error{ErrorCode::kUnavailable, "no memory for a JPEG decoder"};
  int width = 0, height = 0, sampling = 0, colours = 0;
  if (tjDecompressHeader3(decoder.get(), image.bytes.data(), image.bytes.size(), &width, &height, &sampling,
                          &colours) != 0) {
    return bad_jpeg(image, tjGetErrorStr2(decoder.get()));
  }
  if (width != image.width_px || height != image.height_px) {
    return bad_jpeg(image, fmt::format("it has {} x {} pixels", width, height));
  }
  // A warning means damage, most often a truncated image. The missing part would be grey.
  if (tjDecompress2(decoder.get(), image.bytes.data(), image.bytes.size(), rgb, width, 0, height, TJPF_RGB,
                    TJFLAG_ACCURATEDCT | TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS) != 0) {
    return bad_jpeg(image, tjGetErrorStr2(decoder.get()));
  }
  return {};
}

/// Converts the pixels of an image that is not kRgb8 yet and whose bytes have the size of its format.
/// @param rgb receives the pixels
Status convert(const Image& image, std::uint8_t* rgb) {
  const auto width = std::size_t(image.width_px);
  const auto height = std::size_t(image.height_px);
  const std::uint8_t* const from = image.bytes.data();
  switch (image.format) {
    case PixelFormat::kRgb8:
      break;
    case PixelFormat::kBgr8:
      from_bgr8(from, width * height, rgb);
      break;
    case PixelFormat::kGrey8:
      from_grey8(from, width * height, rgb);
      break;
    case PixelFormat::kYuyv:
      from_yuyv(from, width * height / 2, rgb);
      break;
    case PixelFormat::kUyvy:
      from_uyvy(from, width * height / 2, rgb);
      break;
    case PixelFormat::kNv12:
      for (std::size_t row = 0; row < height; ++row) {
        const std::uint8_t* const colours = from + (height + row / 2) * width;
        from_nv12(from + row * width, colours, width / 2, rgb + 3 * row * width);
      }
      break;
    case PixelFormat::kMjpeg:
      return decode_jpeg(image, rgb);
  }
  return {};
}

}  // namespace

std::string_view to_string(PixelFormat format) {
  constexpr std::array<std::string_view, 7> kNames{"rgb8", "bgr8", "grey8", "yuyv", "uyvy", "nv12", "mjpeg"};
  static_assert(kNames.size() == std::size_t(PixelFormat::kMjpeg) + 1);
  return kNames.at(std::size_t(format));
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
    return Error(ErrorCode::kBadData, "image of {} x {} {} pixels holds {} bytes", image.width_px, image.height_px,
                 to_string(image.format), image.bytes.size());
  }
  if (image.format == PixelFormat::kRgb8) return image;
  Image rgb{image.width_px, image.height_px, PixelFormat::kRgb8, {}};
  rgb.bytes.resize(*image_bytes(rgb.format, rgb.width_px, rgb.height_px));
  if (auto converted = convert(image, rgb.bytes.data()); !converted) return converted.error();
  return rgb;
}

Result<Image> to_mjpeg(const Image& image, int quality) {
  const auto rgb = to_rgb8(image);
  if (!rgb) return rgb.error();
  const std::unique_ptr<void, int (*)(tjhandle)> encoder(tjInitCompress(), tjDestroy);
  if (!encoder) return Error{ErrorCode::kUnavailable, "no memory for a JPEG encoder"};
  unsigned char* bytes = nullptr;  // libturbojpeg allocates them
  unsigned long size = 0;          // NOLINT(google-runtime-int): its type
  const int status = tjCompress2(encoder.get(), rgb->bytes.data(), rgb->width_px, 0, rgb->height_px, TJPF_RGB, &bytes,
                                 &size, TJSAMP_422, quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owner(bytes, tjFree);
  if (status != 0) return Error{ErrorCode::kUnavailable, tjGetErrorStr2(encoder.get())};
  return Image{rgb->width_px, rgb->height_px, PixelFormat::kMjpeg, {bytes, bytes + size}};
}

std::shared_future<ImageResult> ready_image(ImageResult image) {
  std::promise<ImageResult> promise;
  promise.set_value(std::move(image));
  return promise.get_future().share();
}

ImageResult Frame::image(std::chrono::milliseconds timeout) const {
  // Each call waits on its own copy: two threads must not wait on one shared_future object.
  const auto pixels = pixels_;
  if (pixels.wait_for(std::min(timeout, kLongestWait)) != std::future_status::ready) {
    return Error(ErrorCode::kTimeout, "the pixels of frame {} did not come within {} ms", header_.sequence,
                 timeout.count());
  }
  return pixels.get();
}

}  // namespace twocone

// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/images.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace twocone::vm {
namespace {

struct Colour {
  double red, green, blue;
};

Colour colour_at(const std::uint8_t* rgb) { return {double(rgb[0]), double(rgb[1]), double(rgb[2])}; }

std::uint8_t to_byte(double value) { return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))); }

double luma(const Colour& c) { return 0.299 * c.red + 0.587 * c.green + 0.114 * c.blue; }

}  // namespace

Image to_yuyv(const Image& rgb) {
  assert(rgb.format == PixelFormat::kRgb8 && rgb.width_px % 2 == 0);
  constexpr double kLumaScale = 219.0 / 255;
  constexpr double kChromaScale = 224.0 / 255;
  std::vector<std::uint8_t> out;
  out.reserve(rgb.bytes.size() / 3 * 2);
  for (std::size_t at = 0; at < rgb.bytes.size(); at += 6) {
    const Colour first = colour_at(rgb.bytes.data() + at);
    const Colour second = colour_at(rgb.bytes.data() + at + 3);
    const Colour mean{(first.red + second.red) / 2, (first.green + second.green) / 2, (first.blue + second.blue) / 2};
    out.push_back(to_byte(16 + kLumaScale * luma(first)));
    out.push_back(to_byte(128 + kChromaScale * (mean.blue - luma(mean)) / 1.772));
    out.push_back(to_byte(16 + kLumaScale * luma(second)));
    out.push_back(to_byte(128 + kChromaScale * (mean.red - luma(mean)) / 1.402));
  }
  return {rgb.width_px, rgb.height_px, PixelFormat::kYuyv, std::move(out)};
}

Result<std::uint64_t> fingerprint(const Image& image) {
  const auto rgb = to_rgb8(image);
  if (!rgb) return rgb.error();
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const std::uint8_t byte : rgb->bytes) hash = (hash ^ byte) * 0x100000001b3;
  return hash;
}

}  // namespace twocone::vm

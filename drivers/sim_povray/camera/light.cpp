// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/camera/light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace twocone::sim_povray {
namespace {

double to_linear(double code) { return code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4); }

/// Tables for both directions. The curve's greatest slope is 12.92 * 255 = 3295 codes for the whole scale: a bin of
/// 1/4096 contains at most one change from one code to the next, so one comparison finds the code.
struct SrgbTables {
  static constexpr int kBins = 4096;
  std::array<float, 256> light{};            ///< light of each code
  std::array<float, 256> next_from{};        ///< least light of the next code; the last entry is never reached
  std::array<std::uint8_t, kBins + 1> code;  ///< code of each bin's least light

  SrgbTables() {
    for (int i = 0; i < 256; ++i) {
      light[std::size_t(i)] = static_cast<float>(to_linear(i / 255.0));
      next_from[std::size_t(i)] = i < 255 ? static_cast<float>(to_linear((i + 0.5) / 255.0)) : 2.0F;
    }
    std::size_t now = 0;
    for (int bin = 0; bin <= kBins; ++bin) {
      while (static_cast<float>(bin) / kBins >= next_from[now]) ++now;
      code[std::size_t(bin)] = static_cast<std::uint8_t>(now);
    }
  }
};

const SrgbTables& tables() {
  static const SrgbTables kTables;
  return kTables;
}

std::uint8_t encode(const SrgbTables& table, float light) {
  const float clipped = light > 0 ? std::min(light, 1.0F) : 0.0F;
  const std::uint8_t code = table.code[std::size_t(static_cast<int>(clipped * SrgbTables::kBins))];
  return static_cast<std::uint8_t>(code + (clipped >= table.next_from[code] ? 1 : 0));
}

}  // namespace

float decode_srgb(std::uint8_t code) { return tables().light[code]; }

std::uint8_t encode_srgb(float light) { return encode(tables(), light); }

Light mean_light(const std::vector<const Image*>& images, const std::vector<std::vector<int>>& row_sources) {
  const SrgbTables& table = tables();
  const Image& first = *images.front();
  Light light{first.width_px, first.height_px, std::vector<float>(first.bytes.size())};
  const std::size_t row_size = std::size_t(first.width_px) * 3;
  for (std::size_t row = 0; row < std::size_t(first.height_px); ++row) {
    float* const out = &light.values[row * row_size];
    const std::vector<int>& sources = row_sources[row];
    for (const int source : sources) {
      const std::uint8_t* const in = &images[std::size_t(source)]->bytes[row * row_size];
      for (std::size_t i = 0; i < row_size; ++i) out[i] += table.light[in[i]];
    }
    if (sources.size() == 1) continue;
    const float share = 1.0F / static_cast<float>(sources.size());
    for (std::size_t i = 0; i < row_size; ++i) out[i] *= share;
  }
  return light;
}

Image to_image(const Light& light) {
  const SrgbTables& table = tables();
  Image image{light.width_px, light.height_px, PixelFormat::kRgb8, {}};
  image.bytes.resize(light.values.size());
  std::transform(light.values.begin(), light.values.end(), image.bytes.begin(),
                 [&](float value) { return encode(table, value); });
  return image;
}

}  // namespace twocone::sim_povray

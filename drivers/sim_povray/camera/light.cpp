// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/camera/light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/hash.h"

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

struct Coefficients {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;

  explicit Coefficients(const std::vector<double>& k) {
    double* const all[] = {&k1, &k2, &p1, &p2, &k3};
    for (std::size_t i = 0; i < std::min(k.size(), std::size(all)); ++i) *all[i] = k[i];
  }
};

LensPoint distort(const Coefficients& c, const LensPoint& p) {
  const double r2 = p.x * p.x + p.y * p.y;
  const double s = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  return {p.x * s + 2 * c.p1 * p.x * p.y + c.p2 * (r2 + 2 * p.x * p.x),
          p.y * s + c.p1 * (r2 + 2 * p.y * p.y) + 2 * c.p2 * p.x * p.y};
}

/// Inverts the lens by Newton's method from the seen point: quadratic, two to four iterations for real lenses.
LensPoint undistort(const Coefficients& c, const LensPoint& seen) {
  constexpr int kMostSteps = 20;
  constexpr double kCloseEnough = 1e-9;
  LensPoint p = seen;
  for (int i = 0; i < kMostSteps; ++i) {
    const double r2 = p.x * p.x + p.y * p.y;
    const double s = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
    const double ds = 2 * (c.k1 + r2 * (2 * c.k2 + r2 * 3 * c.k3));  // (ds/dx) / x
    const double xx = s + p.x * p.x * ds + 2 * c.p1 * p.y + 6 * c.p2 * p.x;
    const double xy = p.x * p.y * ds + 2 * c.p1 * p.x + 2 * c.p2 * p.y;  // the matrix is symmetric
    const double yy = s + p.y * p.y * ds + 6 * c.p1 * p.y + 2 * c.p2 * p.x;
    const double determinant = xx * yy - xy * xy;
    // Both eigenvalues must be positive: beyond the fold the image is inside out.
    if (!(determinant > 0) || !(xx + yy > 0)) break;
    const LensPoint now = distort(c, p);
    const double ex = seen.x - now.x;
    const double ey = seen.y - now.y;
    if (std::abs(ex) + std::abs(ey) < kCloseEnough) return p;
    p = {p.x + (yy * ex - xy * ey) / determinant, p.y + (xx * ey - xy * ex) / determinant};
  }
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  return {kNone, kNone};
}

/// Share of a disc in one pixel; all shares sum to 1.
struct Tap {
  int dx, dy;
  float share;
};

std::vector<Tap> disc(double radius_px, int reach) {
  constexpr int kGrid = 16;
  std::vector<Tap> taps;
  double sum = 0;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      int inside = 0;
      for (int i = 0; i < kGrid * kGrid; ++i) {
        const int right = i % kGrid, down = i / kGrid;
        const double x = dx + (right + 0.5) / kGrid - 0.5;
        const double y = dy + (down + 0.5) / kGrid - 0.5;
        if (x * x + y * y <= radius_px * radius_px) ++inside;
      }
      if (inside > 0) taps.push_back({dx, dy, static_cast<float>(inside)});
      sum += inside;
    }
  }
  if (taps.empty()) return {{0, 0, 1.0F}};  // the disc is smaller than the grid
  for (Tap& tap : taps) tap.share = static_cast<float>(tap.share / sum);
  return taps;
}

}  // namespace

Light mean_light(const std::vector<const Image*>& images, const std::vector<std::vector<ImageShare>>& row_shares) {
  const SrgbTables& table = tables();
  const Image& first = *images.front();
  Light light{first.width_px, first.height_px, std::vector<float>(first.bytes.size())};
  const std::size_t row_size = std::size_t(first.width_px) * 3;
  for (std::size_t row = 0; row < std::size_t(first.height_px); ++row) {
    float* const out = &light.values[row * row_size];
    for (const auto& [image, share] : row_shares[row]) {
      const std::uint8_t* const in = &images[std::size_t(image)]->bytes[row * row_size];
      for (std::size_t i = 0; i < row_size; ++i) out[i] += share * table.light[in[i]];
    }
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

LensPoint undistort(const std::vector<double>& k, const LensPoint& seen) { return undistort(Coefficients(k), seen); }

Light distorted(const Light& ideal, const std::vector<double>& k, double focal_px) {
  const Coefficients lens(k);
  Light out{ideal.width_px, ideal.height_px, std::vector<float>(ideal.values.size())};
  const double centre_column = (ideal.width_px - 1) / 2.0;
  const double centre_row = (ideal.height_px - 1) / 2.0;
  const std::size_t row_size = std::size_t(ideal.width_px) * 3;
  float* value = out.values.data();
  for (int row = 0; row < ideal.height_px; ++row) {
    for (int column = 0; column < ideal.width_px; ++column, value += 3) {
      const LensPoint seen{(column - centre_column) / focal_px, (row - centre_row) / focal_px};
      const LensPoint point = undistort(lens, seen);
      const double x = column + (point.x - seen.x) * focal_px;
      const double y = row + (point.y - seen.y) * focal_px;
      // The image extends to the edges of its outer pixels. The comparison also excludes values that are not a number.
      if (!(x >= -0.5 && x <= ideal.width_px - 0.5 && y >= -0.5 && y <= ideal.height_px - 0.5)) continue;
      const double left = std::clamp(x, 0.0, ideal.width_px - 1.0);
      const double top = std::clamp(y, 0.0, ideal.height_px - 1.0);
      const auto x0 = static_cast<std::size_t>(left);
      const auto y0 = static_cast<std::size_t>(top);
      const std::size_t x1 = std::min(x0 + 1, std::size_t(ideal.width_px) - 1);
      const std::size_t y1 = std::min(y0 + 1, std::size_t(ideal.height_px) - 1);
      const auto across = static_cast<float>(left - static_cast<double>(x0));
      const auto down = static_cast<float>(top - static_cast<double>(y0));
      const float* const upper = &ideal.values[y0 * row_size];
      const float* const lower = &ideal.values[y1 * row_size];
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const float a = upper[3 * x0 + channel], b = upper[3 * x1 + channel];
        const float c = lower[3 * x0 + channel], d = lower[3 * x1 + channel];
        const float above = a + across * (b - a);
        value[channel] = above + down * (c + across * (d - c) - above);
      }
    }
  }
  return out;
}

Light defocused(const Light& sharp, double radius_px) {
  const int reach = std::max(0, static_cast<int>(std::ceil(radius_px - 0.5)));
  const std::vector<Tap> taps = disc(radius_px, reach);
  const std::size_t row_size = std::size_t(sharp.width_px) * 3;
  const std::size_t margin = std::size_t(reach) * 3;
  // Rows are extended by their end pixels, so that the inner loop needs no edge case.
  const std::size_t wide_size = row_size + 2 * margin;
  std::vector<float> wide(wide_size * std::size_t(sharp.height_px));
  for (std::size_t row = 0; row < std::size_t(sharp.height_px); ++row) {
    const float* const in = &sharp.values[row * row_size];
    float* const out = &wide[row * wide_size];
    for (std::size_t i = 0; i < margin; ++i) {
      out[i] = in[i % 3];
      out[margin + row_size + i] = in[row_size - 3 + i % 3];
    }
    std::copy(in, in + row_size, out + margin);
  }
  Light out{sharp.width_px, sharp.height_px, std::vector<float>(sharp.values.size())};
  for (int row = 0; row < sharp.height_px; ++row) {
    float* const sum = &out.values[std::size_t(row) * row_size];
    for (const Tap& tap : taps) {
      const auto from = std::size_t(std::clamp(row + tap.dy, 0, sharp.height_px - 1));
      const float* const in = &wide[from * wide_size + std::size_t(reach + tap.dx) * 3];
      for (std::size_t i = 0; i < row_size; ++i) sum[i] += tap.share * in[i];
    }
  }
  return out;
}

void multiply_channels(Light& light, std::span<const double> gains) {
  for (std::size_t i = 0; i < light.values.size(); ++i) light.values[i] *= static_cast<float>(gains[i % 3]);
}

void multiply_rows(Light& light, std::span<const float> gains) {
  const std::size_t row_size = std::size_t(light.width_px) * 3;
  for (std::size_t i = 0; i < light.values.size(); ++i) light.values[i] *= gains[i / row_size];
}

void vignette(Light& light, double vignetting) {
  const double centre_column = (light.width_px - 1) / 2.0;
  const double centre_row = (light.height_px - 1) / 2.0;
  const double corner2 = centre_column * centre_column + centre_row * centre_row;
  const double loss = corner2 > 0 ? vignetting / corner2 : 0;  // a single pixel has no corner
  float* value = light.values.data();
  for (int row = 0; row < light.height_px; ++row) {
    const double dy2 = (row - centre_row) * (row - centre_row);
    for (int column = 0; column < light.width_px; ++column, value += 3) {
      const double dx = column - centre_column;
      const auto kept = static_cast<float>(1 - loss * (dx * dx + dy2));
      for (int channel = 0; channel < 3; ++channel) value[channel] *= kept;
    }
  }
}

std::mt19937_64 camera_engine(std::uint64_t seed, CameraPurpose purpose, std::string_view camera, std::uint64_t step) {
  const std::uint64_t name = base::fnv1a(camera);
  const auto low = [](std::uint64_t value) { return static_cast<std::uint32_t>(value & 0xffffffffU); };
  const auto high = [](std::uint64_t value) { return static_cast<std::uint32_t>(value >> 32); };
  std::seed_seq words{low(seed), high(seed), static_cast<std::uint32_t>(purpose), low(name), high(name),
                      low(step), high(step)};
  return std::mt19937_64(words);
}

void add_shot_noise(Light& light, double full_well_electrons, Normal normal) {
  const auto one_electron = static_cast<float>(full_well_electrons > 0 ? 1 / full_well_electrons : 0);
  for (float& value : light.values) {
    value += std::sqrt(std::max(value, 0.0F) * one_electron) * static_cast<float>(normal());
  }
}

void add_read_noise(Light& light, double sigma, Normal normal) {
  const auto scale = static_cast<float>(sigma);
  for (std::size_t i = 0; i + 2 < light.values.size(); i += 3) {
    float* const pixel = light.values.data() + i;
    const bool is_rendered = pixel[0] != 0 || pixel[1] != 0 || pixel[2] != 0;
    for (int channel = 0; channel < 3; ++channel) {
      // The number is drawn in any case, so that no pixel's noise depends on another's light.
      const float noise = scale * static_cast<float>(normal());
      if (is_rendered) pixel[channel] += noise;
    }
  }
}

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
// Anti-aliasing as POV-Ray's `+AM1 +A0.03` was measured to do it.
#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <vector>

#include "drivers/sim_povray/render/native/native_view.h"
#include "drivers/sim_povray/render/native/pigment_colour.h"

namespace twocone::sim_povray {
namespace {

// The neighbours' difference from which POV-Ray's +A0.03 takes more samples, and how it weighs light: measured.
constexpr double kSmoothingThreshold = 0.03;
constexpr double kSmoothingGamma = 0.4;

/// Returns a colour as smoothing weighs it.
Colour weighed(const Colour& colour) {
  const auto of = [](double light) { return light > 0 ? std::pow(light, kSmoothingGamma) : 0; };
  return {of(colour.x), of(colour.y), of(colour.z)};
}

bool differ(const Colour& weighed_a, const Colour& weighed_b) {
  const Colour by = weighed_a - weighed_b;
  return std::abs(by.x) + std::abs(by.y) + std::abs(by.z) >= kSmoothingThreshold;
}

}  // namespace

/// The pixels of a block, with one column to its left and one row above it.
struct NativeView::SmoothedBlock {
  struct Pixel {
    Colour colour{};   ///< the centre's, or the mean of the samples
    Colour weighed{};  ///< weighed(colour)
    Colour sampled{};  ///< the mean, if has_samples
    bool has_samples = false;
    bool is_smooth = false;
  };
  Pixel& at(int x, int y) { return pixels[std::size_t(y) + 1][std::size_t(x) + 1]; }
  std::array<std::array<Pixel, kBlock_px + 1>, kBlock_px + 1> pixels{};
};

NativeView::FixedSamples NativeView::samples_of_tile(int column, int row) const {
  FixedSamples result;
  result.surroundings = ~own_;
  result.samples.resize(std::size_t(kTileRays) * std::size_t(antialias_) * std::size_t(antialias_));
  auto sample = result.samples.begin();
  const auto is_common = [](FixedPixel& common, const FixedPixel& pixel) {
    if (common.kind == FixedPixel::Kind::kAny) common = pixel;
    return common == pixel;
  };
  for (int lane = 0; lane < kTileRays; ++lane) {
    const int x = column + lane % kTileSide;
    const int y = row + lane / kTileSide;
    for (int i = 0; i < antialias_ * antialias_; ++i, ++sample) {
      bool meets_own = false;
      Vec3 end;
      const FixedPixel pixel = fixed_pixel(camera_ray(sample_point(x, y, i)), sample->reflected, meets_own, end);
      if (pixel.kind == FixedPixel::Kind::kAny || !is_within(end, sight_)) continue;
      if (!is_common(pixel.kind == FixedPixel::Kind::kMirror ? result.mirror : result.constant, pixel)) continue;
      sample->kind = pixel.kind;
      if (meets_own) result.surroundings = kAllGroups;
    }
  }
  return result;
}

const NativeView::FixedSamples& NativeView::fixed_samples(int x, int y) const {
  const std::size_t index = tile_index(x, y);
  LazySamples& lazy = samples_[index];
  std::call_once(lazy.made, [&] {
    lazy.samples = samples_of_tile(x - (x - window_.first_column) % kTileSide, y - (y - window_.first_row) % kTileSide);
  });
  return lazy.samples;
}

void NativeView::reflect(const Moment& moment, std::span<const MirrorSample> wanted, std::span<Colour> colours) const {
  thread_local RayBundle bundle;
  thread_local SeenTile seen;
  thread_local Lane weights;
  thread_local TileVectors origin, direction;
  bundle.t_max.fill(kInfinity);
  for (; !wanted.empty(); wanted = wanted.subspan(std::min<std::size_t>(kTileRays, wanted.size()))) {
    const std::size_t count = std::min<std::size_t>(kTileRays, wanted.size());
    GroupSet surroundings = 0;
    for (std::size_t i = 0; i < kTileRays; ++i) {
      const MirrorSample& sample = wanted[std::min(i, count - 1)];
      origin.set(int(i), sample.reflected->origin);
      direction.set(int(i), sample.reflected->direction);
      weights[i] = greatest_component(sample.tile->mirror.share);
      surroundings |= sample.tile->surroundings;
    }
    bundle.used = ~std::uint64_t{0} >> (kTileRays - count);
    transform_rays(moment.posed.poses().view, origin, direction, bundle.rays);
    trace_tile(moment.posed, bundle, 2, surroundings, weights, seen);
    for (std::size_t i = 0; i < count; ++i) {
      const FixedPixel& mirror = wanted[i].tile->mirror;
      colours[wanted[i].index] = mirror.colour + mirror.share * seen.colours.at(int(i));
    }
  }
}

void NativeView::take_samples(const Moment& moment, int left, int top, std::span<const BlockPlace> places,
                              SmoothedBlock& block) const {
  thread_local std::vector<ImagePoint> points;
  thread_local std::vector<std::size_t> indices;  // of the points' colours
  thread_local std::vector<MirrorSample> reflected;
  thread_local std::vector<Colour> colours, seen;
  const auto samples = std::size_t(antialias_) * std::size_t(antialias_);
  points.clear();
  indices.clear();
  reflected.clear();
  colours.resize(places.size() * samples);
  std::size_t index = 0;
  for (const BlockPlace& place : places) {
    const int x = left + place.x;
    const int y = top + place.y;
    const FixedSamples* const fixed = moment.is_planned && !samples_.empty() ? &fixed_samples(x, y) : nullptr;
    for (std::size_t i = 0; i < samples; ++i, ++index) {
      const FixedSamples::Sample* const sample = fixed ? &fixed->samples[lane_of(x, y) * samples + i] : nullptr;
      if (sample != nullptr && sample->kind == FixedPixel::Kind::kMirror) {
        reflected.push_back({fixed, &sample->reflected, index});
      } else if (sample != nullptr && sample->kind == FixedPixel::Kind::kConstant) {
        colours[index] = fixed->constant.colour;
      } else {
        points.push_back(sample_point(x, y, int(i)));
        indices.push_back(index);
      }
    }
  }
  reflect(moment, reflected, colours);
  seen.resize(points.size());
  look(moment, points, seen);
  for (std::size_t i = 0; i < points.size(); ++i) colours[indices[i]] = seen[i];
  auto colour = colours.begin();
  for (const BlockPlace& place : places) {
    SmoothedBlock::Pixel& pixel = block.at(place.x, place.y);
    pixel.sampled = pixel.colour;
    for (std::size_t i = 0; i < samples; ++i) pixel.sampled += *colour++;
    pixel.sampled = pixel.sampled / double(samples + 1);
    pixel.has_samples = true;
  }
}

void NativeView::smooth(const Moment& moment, int left, int right, int top, int bottom, SmoothedBlock& block) const {
  const int width = right - left + 1;
  const int height = bottom - top + 1;
  // The pixels whose centres differ are nearly all that need samples, and are sampled together.
  thread_local std::vector<BlockPlace> places;
  places.clear();
  const auto add = [&](int x, int y) {
    SmoothedBlock::Pixel& pixel = block.at(x, y);
    if (x < 0 || y < 0 || pixel.has_samples) return;
    pixel.has_samples = true;
    places.push_back({x, y});
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool differs_left = differ(block.at(x, y).weighed, block.at(x - 1, y).weighed);
      const bool differs_above = differ(block.at(x, y).weighed, block.at(x, y - 1).weighed);
      if (differs_left) add(x - 1, y);
      if (differs_above) add(x, y - 1);
      if (differs_left || differs_above) add(x, y);
    }
  }
  take_samples(moment, left, top, places, block);
  const auto replace = [&](int x, int y) {
    SmoothedBlock::Pixel& pixel = block.at(x, y);
    if (x < 0 || y < 0 || pixel.is_smooth) return;
    if (!pixel.has_samples) take_samples(moment, left, top, std::array{BlockPlace{x, y}}, block);
    pixel.colour = pixel.sampled;
    pixel.weighed = weighed(pixel.colour);
    pixel.is_smooth = true;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      // A neighbour counts as it is at this moment, and those of another block are not changed.
      const bool differs_left = differ(block.at(x, y).weighed, block.at(x - 1, y).weighed);
      const bool differs_above = differ(block.at(x, y).weighed, block.at(x, y - 1).weighed);
      if (differs_left) replace(x - 1, y);
      if (differs_above) replace(x, y - 1);
      if (differs_left || differs_above) replace(x, y);
    }
  }
}

void NativeView::render_smoothed(const Moment& moment, int band, Image& image, PixelTruth* truth) const {
  const int top = window_.first_row + band * kBlock_px;
  const int bottom = std::min(top + kBlock_px - 1, window_.last_row);
  // With one row above and one column to the left.
  const auto columns = std::size_t(window_.last_column - window_.first_column) + 2;
  thread_local std::vector<Colour> colours;
  thread_local std::vector<ImagePoint> outside;
  thread_local std::vector<Colour> seen_outside;
  colours.resize(columns * (kBlock_px + 1));
  const auto at = [&](int x, int y) -> Colour& {
    return colours[std::size_t(y - top + 1) * columns + std::size_t(x - window_.first_column + 1)];
  };
  const auto keep = [&](int column, int row, std::uint64_t inside, const TileVectors& tile) {
    for_each_lane(inside, [&](int lane) { at(column + lane % kTileSide, row + lane / kTileSide) = tile.at(lane); });
  };
  visit_tiles(moment, top, bottom, truth, keep);
  if (band > 0) visit_tiles(moment, top - 1, top - 1, nullptr, keep);
  outside.clear();
  const auto for_each_outside = [&](auto visit) {
    for (int x = window_.first_column; band == 0 && x <= window_.last_column; ++x) visit(x, top - 1);
    for (int y = top - 1; y <= bottom; ++y) visit(window_.first_column - 1, y);
  };
  for_each_outside([&](int x, int y) { outside.push_back(centre_of(x, y)); });
  seen_outside.resize(outside.size());
  look(moment, outside, seen_outside);
  std::size_t next = 0;
  for_each_outside([&](int x, int y) { at(x, y) = seen_outside[next++]; });

  thread_local SmoothedBlock block;
  thread_local TileVectors tile;
  TileBytes bytes;
  for (int left = window_.first_column; left <= window_.last_column; left += kBlock_px) {
    const int right = std::min(left + kBlock_px - 1, window_.last_column);
    for (int y = top - 1; y <= bottom; ++y) {
      for (int x = left - 1; x <= right; ++x) {
        SmoothedBlock::Pixel& pixel = block.at(x - left, y - top);
        pixel = {.colour = at(x, y)};
        pixel.weighed = weighed(pixel.colour);
      }
    }
    smooth(moment, left, right, top, bottom, block);
    for (int y = top; y <= bottom; ++y) {
      const int width = right - left + 1;
      for (int x = 0; x < width; ++x) tile.set(x, block.at(x, y - top).colour);
      srgb_bytes(tile, bytes);
      store(bytes, 0, width, pixel_index(left, y), image);
    }
  }
}

}  // namespace twocone::sim_povray

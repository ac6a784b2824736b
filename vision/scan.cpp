// SPDX-License-Identifier: Apache-2.0
#include "vision/scan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

#include "base/errors.h"

namespace twocone::vision {
namespace {

// One wrong range is usual, and windows of 19 slopes x 3 azimuths give its neighbours wrong ranges, too. A thing of
// this many pixels at 2 m is 2 cm high and a degree wide.
constexpr std::size_t kLeastPixels = 8;
// Ranges of one thing differ by no more than this many of their sigmas, and this share of the range.
constexpr double kAgreeSigmas = 3;
constexpr double kAgreeShare = 0.02;

struct RangedPixel {
  double range_m, sigma_m, height_m;
};

/// Returns the nearest thing of ascending ranges.
Beam nearest_thing(const std::vector<RangedPixel>& ranged) {
  for (std::size_t first = 0; first + kLeastPixels <= ranged.size(); ++first) {
    const double within_m = kAgreeSigmas * ranged[first].sigma_m + kAgreeShare * ranged[first].range_m;
    const std::size_t last = first + kLeastPixels - 1;
    if (ranged[last].range_m > ranged[first].range_m + 2 * within_m) continue;
    // The nearest of a wall's ranges are those that are too short: all that may be of the same thing count.
    const double farthest_m = ranged[(first + last) / 2].range_m + within_m;
    const auto end = std::ranges::upper_bound(ranged, farthest_m, {}, &RangedPixel::range_m);
    const std::span<const RangedPixel> thing(ranged.begin() + std::ptrdiff_t(first), end);
    const RangedPixel& middle = thing[thing.size() / 2];
    const double top_m = std::ranges::max(thing, {}, &RangedPixel::height_m).height_m;
    return {BeamState::kOccupied, middle.range_m, middle.sigma_m, top_m};
  }
  return {};
}

}  // namespace

std::string_view to_string(BeamState state) {
  constexpr std::array<std::string_view, 3> kNames{"unknown", "free", "occupied"};
  static_assert(std::size_t(BeamState::kOccupied) + 1 == kNames.size());
  return kNames.at(std::size_t(state));
}

std::vector<Beam> scan_of(const RangeImage& image, const ScanSettings& settings) {
  base::Complaints bad;
  bad.require(settings.beams >= 1, "beams is {}, must be >= 1", settings.beams);
  bad.require(settings.low_m < settings.high_m, "low_m is {} m and high_m {} m, must be less", settings.low_m,
              settings.high_m);
  bad.require(settings.sigmas >= 0, "sigmas is {}, must be >= 0", settings.sigmas);
  bad.raise("scan_of");
  const std::size_t beams = std::size_t(settings.beams);
  std::vector<std::vector<RangedPixel>> things(beams);
  std::vector<std::vector<double>> others(beams);
  std::vector<std::uint32_t> floor(beams);
  for (int a = 0; a < image.grid.azimuths; ++a) {
    for (int i = 0; i < image.grid.slopes; ++i) {
      if (image.verdict_at(a, i) != DenseVerdict::kOk) continue;
      const double range_m = image.range_m.at<float>(a, i);
      const double sigma_m = image.sigma_m.at<float>(a, i);
      const double height_m = image.height_m.at<float>(a, i);
      const double turn = (double(image.bearing_rad.at<float>(a, i)) + std::numbers::pi) / (2 * std::numbers::pi);
      const std::size_t beam = std::min(beams - 1, std::size_t(std::max(0.0, turn) * double(beams)));
      if (height_m < settings.low_m) floor[beam] |= Beam::floor_bit(range_m);
      // A longer range moves the point along its ray.
      const double height_sigma_m = std::abs(image.grid.slope(i)) * sigma_m;
      const bool is_below = height_m < settings.low_m - settings.sigmas * height_sigma_m;
      const bool is_above = height_m > settings.high_m + settings.sigmas * height_sigma_m;
      if (is_below || is_above) {
        others[beam].push_back(range_m);
      } else {
        things[beam].push_back({range_m, sigma_m, height_m});
      }
    }
  }
  std::vector<Beam> scan(beams);
  for (std::size_t k = 0; k < beams; ++k) {
    std::ranges::sort(things[k], {}, &RangedPixel::range_m);
    scan[k] = nearest_thing(things[k]);
    scan[k].floor = floor[k];
    if (scan[k].state == BeamState::kOccupied || others[k].size() < kLeastPixels) continue;
    // The farthest, without as many wrong ones as a thing must have pixels.
    std::ranges::sort(others[k]);
    scan[k].state = BeamState::kFree;
    scan[k].range_m = others[k][others[k].size() - kLeastPixels];
  }
  return scan;
}

std::vector<RangedPoint> points_of(const RangeImage& image) {
  std::vector<RangedPoint> points;
  for (int a = 0; a < image.grid.azimuths; ++a) {
    for (int i = 0; i < image.grid.slopes; ++i) {
      if (image.verdict_at(a, i) != DenseVerdict::kOk) continue;
      const double bearing_rad = image.bearing_rad.at<float>(a, i);
      const double range_m = image.range_m.at<float>(a, i);
      points.push_back(
          {{range_m * std::cos(bearing_rad), range_m * std::sin(bearing_rad), image.height_m.at<float>(a, i)},
           image.sigma_m.at<float>(a, i)});
    }
  }
  return points;
}

}  // namespace twocone::vision

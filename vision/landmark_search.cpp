// SPDX-License-Identifier: Apache-2.0
#include "vision/landmark_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/plane.h"
#include "vision/bands/band_finder.h"
#include "vision/hue_labels.h"
#include "vision/method_arguments.h"
#include "vision/outline/view_fitter.h"
#include "vision/triangulation.h"

namespace twocone::vision {
namespace {

constexpr int kHueBins = 360;
// A landmark's hue varies by some degrees between light and shade. Tuned by hand on rendered images; no test fixes it.
constexpr double kHueSpread_bins = 4;
// A thing of 30 pixels in a mirror with a radius of 200 px.
constexpr double kLeastHueShare = 2.5e-4;
// A colour counts by the mean over this share of the images, those that show it most: a landmark may be seen in a part
// of a drive only.
constexpr double kShowingImages = 0.2;
// Pixels nearer to the tip show what is at the horizon, and nothing of a landmark that could be measured.
constexpr double kLeastRadius_px = 8;

// Views whose bearings differ by more are of two things, however uncertain the rig is.
constexpr double kMostApart_rad = 20 * std::numbers::pi / 180;
// Farther or higher things are no landmarks of a room.
constexpr double kFarthest_m = 30;
constexpr double kHighest_m = 6;
// A wedge that is wider is a wall, not a landmark: one of a radius of 0.1 m at 0.3 m has 0.34 rad.
constexpr double kWidest_rad = 0.5;
// Radius with which a thing is placed before its own is known.
constexpr double kAssumedRadius_m = 0.04;
constexpr double kAssumedPixelSigma_px = 0.6;

std::size_t bin_of(double hue_rad) {
  const double turned = hue_rad < 0 ? hue_rad + 2 * std::numbers::pi : hue_rad;
  return std::min<std::size_t>(kHueBins - 1, std::size_t(turned / (2 * std::numbers::pi) * kHueBins));
}

/// Returns the mean over each bin's neighbours, weighted by a Gaussian, round the circle.
std::array<double, kHueBins> smooth(const std::array<double, kHueBins>& counts) {
  constexpr int kReach = static_cast<int>(4 * kHueSpread_bins);
  std::array<double, kHueBins> smoothed{};
  for (int i = 0; i < kHueBins; ++i) {
    for (int k = -kReach; k <= kReach; ++k) {
      const double weight = std::exp(-k * k / (2 * kHueSpread_bins * kHueSpread_bins));
      smoothed[std::size_t(i)] += weight * counts[std::size_t((i + k + kHueBins) % kHueBins)];
    }
  }
  return smoothed;
}

/// The vivid pixels of one image by hue, as shares of the mirror, and the sums of their light.
struct HueCounts {
  std::array<double, kHueBins> shares{};
  std::array<Eigen::Vector3d, kHueBins> light{};
};

HueCounts count_hues(const MirrorImage& image) {
  if (image.rgb.type() != CV_8UC3) throw base::InvalidArgument("find_hues: an image is not of type CV_8UC3 (r g b)");
  HueCounts counts;
  counts.light.fill(Eigen::Vector3d::Zero());
  const std::array<float, 256>& light_of = light_of_code();
  constexpr int kStride = 2;
  double pixels = 0;
  for (int row = 0; row < image.rgb.rows; row += kStride) {
    const auto* line = image.rgb.ptr<cv::Vec3b>(row);
    for (int column = 0; column < image.rgb.cols; column += kStride) {
      const double radius_px = std::hypot(column - image.centre_px.x(), row - image.centre_px.y());
      if (radius_px > image.rim_radius_px) continue;
      ++pixels;
      if (radius_px < kLeastRadius_px) continue;
      const cv::Vec3b& code = line[column];
      const Eigen::Vector3d light(light_of[code[0]], light_of[code[1]], light_of[code[2]]);
      if (light.maxCoeff() < HueLabels::kMinBrightness) continue;
      if (saturation({light.x(), light.y(), light.z()}) < HueLabels::kMinSaturation) continue;
      const std::size_t bin = bin_of(hue_rad({light.x(), light.y(), light.z()}));
      ++counts.shares[bin];
      counts.light[bin] += light;
    }
  }
  for (double& share : counts.shares) share /= std::max(pixels, 1.0);
  return counts;
}

}  // namespace

std::vector<Eigen::Vector3d> find_hues(const std::vector<MirrorImage>& images) {
  std::vector<std::array<double, kHueBins>> shares;
  std::array<Eigen::Vector3d, kHueBins> light;
  light.fill(Eigen::Vector3d::Zero());
  for (const MirrorImage& image : images) {
    const HueCounts counts = count_hues(image);
    shares.push_back(smooth(counts.shares));
    for (std::size_t i = 0; i < light.size(); ++i) light[i] += counts.light[i];
  }
  if (shares.empty()) return {};
  const auto showing = std::max<std::size_t>(1, std::size_t(kShowingImages * double(shares.size())));
  std::array<double, kHueBins> found{};
  for (std::size_t i = 0; i < found.size(); ++i) {
    std::vector<double> of_images;
    of_images.reserve(shares.size());
    for (const auto& of_image : shares) of_images.push_back(of_image[i]);
    std::ranges::nth_element(of_images, of_images.begin() + std::ptrdiff_t(showing - 1), std::greater{});
    const auto end = of_images.begin() + std::ptrdiff_t(showing);
    found[i] = std::accumulate(of_images.begin(), end, 0.0) / double(showing);
  }
  // The greatest peaks first; each keeps others off within the window of a hue.
  constexpr int kWindow = static_cast<int>(HueLabels::kHueWindow_rad / (2 * std::numbers::pi) * kHueBins);
  std::vector<std::size_t> order(kHueBins);
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater{}, [&](std::size_t i) { return found[i]; });
  std::vector<std::size_t> peaks;
  for (const std::size_t i : order) {
    const auto at = [&](int step) { return found[std::size_t((int(i) + step + kHueBins) % kHueBins)]; };
    if (found[i] < kLeastHueShare || at(1) > found[i] || at(-1) > found[i]) continue;
    const auto is_near = [i](std::size_t peak) {
      const int apart = std::abs(int(peak) - int(i));
      return std::min(apart, kHueBins - apart) < kWindow;
    };
    if (std::ranges::none_of(peaks, is_near)) peaks.push_back(i);
  }
  std::ranges::sort(peaks);
  std::vector<Eigen::Vector3d> colours;
  for (const std::size_t peak : peaks) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int step = -kWindow / 2; step <= kWindow / 2; ++step) {
      sum += light[std::size_t((int(peak) + step + kHueBins) % kHueBins)];
    }
    colours.emplace_back(sum / sum.maxCoeff());
  }
  return colours;
}

Landmark looking_like(std::size_t hue, const std::vector<Eigen::Vector3d>& colours) {
  if (hue >= kBandedHue) return Landmark{.bands = Bands{.number = static_cast<int>(hue - kBandedHue)}};
  const Eigen::Vector3d& colour = colours.at(hue);
  return Landmark{.colour = {colour.x(), colour.y(), colour.z()}};
}

std::string looks_of(const Landmark& landmark) {
  return landmark.bands ? fmt::format("bands.{}", landmark.bands->number) : std::string(hue_name(landmark.colour));
}

struct LandmarkSearch::Impl {
  Impl(const Rig& rig, const std::vector<Eigen::Vector3d>& colours, cv::Size lower_size, cv::Size upper_size,
       const BeliefErrors& errors)
      : belief(rig, errors.rig),
        table(colours),
        wanted(colours.size(), true),
        views{ViewFitter(belief.rig().lower, lower_size, table), ViewFitter(belief.rig().upper, upper_size, table)},
        band_finders{BandFinder(belief.rig().lower, lower_size), BandFinder(belief.rig().upper, upper_size)} {}

  using Pair = std::array<const Candidate*, 2>;

  [[nodiscard]] Triangulation meet(const std::array<Sighting, 2>& seen, double radius_m) const {
    return triangulate(belief, {}, seen.data(), &seen[1], radius_m, std::nullopt);
  }

  [[nodiscard]] static bool is_thing(const Triangulation& met) {
    return met.verdict == RangeVerdict::kOk && met.top_m && *met.top_m < kHighest_m && *met.range_m < kFarthest_m;
  }

  /// Returns the thing that both candidates show; nothing where their rays do not meet in the room.
  [[nodiscard]] std::optional<RoughLandmark> thing_of(const Pair& pair, std::size_t hue,
                                                      const std::optional<FrameMotion>& motion) const {
    RoughLandmark thing{.hue = hue};
    for (std::size_t view = 0; view < 2; ++view) {
      thing.views[view].pixel_px = views[view].pixel_of(*pair[view]);
      thing.views[view].covariance_px2 *= kAssumedPixelSigma_px * kAssumedPixelSigma_px;
    }
    Triangulation met = meet(thing.views, kAssumedRadius_m);
    if (!is_thing(met)) return std::nullopt;
    // A wedge of the half angle a has the area a (top^2 - least^2).
    const double top_px = pair[0]->top_px;
    const double half_rad = pair[0]->area_px / (top_px * top_px - kLeastRadius_px * kLeastRadius_px);
    if (!(half_rad > 0) || half_rad > kWidest_rad / 2) return std::nullopt;
    thing.radius_m = *met.range_m * std::sin(half_rad);
    return placed(thing, pair, *met.top_m, motion);
  }

  /// Places a thing of a known radius where the rays of both views to its top meet.
  [[nodiscard]] std::optional<RoughLandmark> placed(RoughLandmark thing, const Pair& pair, double top_m,
                                                    const std::optional<FrameMotion>& motion) const {
    std::array<Sighting, 2> seen;
    for (std::size_t view = 0; view < 2; ++view) {
      const auto found = views[view].found(*pair[view], thing.radius_m, top_m);
      if (!found) return std::nullopt;
      seen[view] = *found;
    }
    const auto to_frame = [&] {
      thing.views = seen;
      if (!motion) return;
      for (std::size_t view = 0; view < 2; ++view) {
        const auto& [stamp_late_s, readout_s] = belief.rig().exposures[view];
        const double late_s = (view == 1 ? motion->upper_later_s : 0) + stamp_late_s +
                              readout_share(seen[view], views[view].size().height) * readout_s;
        const Landmark there{.radius_m = thing.radius_m, .top_m = top_m};
        thing.views[view].pixel_px =
            pixel_at_frame(of_view(belief.rig(), Side(view)), seen[view].pixel_px, there, motion->twist, late_s);
      }
    };
    Triangulation met;
    for (int round = 0; round < 2; ++round) {
      to_frame();
      met = meet(thing.views, thing.radius_m);
      if (!is_thing(met)) return std::nullopt;
      top_m = *met.top_m;
    }
    thing.range_m = *met.range_m;
    thing.bearing_rad = *met.bearing_rad;
    thing.top_m = *met.top_m;
    return thing;
  }

  /// Returns the banded things that both views read. One that a view reads twice is none.
  [[nodiscard]] std::vector<RoughLandmark> banded_things(const cv::Mat& lower, const cv::Mat& upper,
                                                         const std::optional<FrameMotion>& motion) const {
    const std::array found{band_finders[0].find(lower), band_finders[1].find(upper)};
    std::vector<RoughLandmark> things;
    for (const BandCandidate& bands : found[0]) {
      const auto is_same = [&](const BandCandidate& other) { return other.number == bands.number; };
      const auto above = std::ranges::find_if(found[1], is_same);
      if (above == found[1].end() || std::ranges::count_if(found[0], is_same) > 1 ||
          std::ranges::count_if(found[1], is_same) > 1) {
        continue;
      }
      const auto [distance_m, line_m] = band_finders[0].place_of(bands, Bands{}.cell_m);
      const double half_rad = std::numbers::pi / BandFinder::kDirections * bands.candidate.area_px;
      if (half_rad > kWidest_rad / 2 || !(distance_m > 0)) continue;
      RoughLandmark thing{.hue = kBandedHue + std::size_t(bands.number)};
      // The sine of the half angle is that of the radius over the distance to the axis.
      thing.radius_m = distance_m * std::sin(half_rad) / (1 - std::sin(half_rad));
      auto there = placed(thing, {&bands.candidate, &above->candidate}, line_m, motion);
      if (!there) continue;
      there->views[0].covariance_px2 += BandFinder::between_lines_px2(bands.candidate);
      there->views[1].covariance_px2 += BandFinder::between_lines_px2(above->candidate);
      things.push_back(std::move(*there));
    }
    return things;
  }

  /// Returns the pairs of candidates by how far apart their bearings are.
  [[nodiscard]] std::vector<Pair> pairs_of(const Found& lower, const Found& upper) const {
    std::vector<std::pair<double, Pair>> pairs;
    for (const Candidate& a : lower.candidates) {
      for (const Candidate& b : upper.candidates) {
        if (a.at_rim || b.at_rim) continue;
        const double apart_rad = std::abs(base::wrap_angle_rad(views[0].bearing_of(a) - views[1].bearing_of(b)));
        if (apart_rad < kMostApart_rad) pairs.push_back({apart_rad, {&a, &b}});
      }
    }
    std::ranges::stable_sort(pairs, {}, &std::pair<double, Pair>::first);
    std::vector<Pair> sorted;
    sorted.reserve(pairs.size());
    for (const auto& [apart_rad, pair] : pairs) sorted.push_back(pair);
    return sorted;
  }

  UncertainRig belief;
  ColourTable table;
  std::vector<bool> wanted;
  std::array<ViewFitter, 2> views;
  std::array<BandFinder, 2> band_finders;
};

LandmarkSearch::LandmarkSearch(const Rig& rig, const std::vector<Eigen::Vector3d>& colours, cv::Size lower_size,
                               cv::Size upper_size, const BeliefErrors& errors) {
  base::Complaints bad;
  check_sizes(bad, lower_size, upper_size);
  bad.raise("LandmarkSearch");
  impl_ = std::make_unique<const Impl>(rig, colours, lower_size, upper_size, errors);
}
LandmarkSearch::~LandmarkSearch() = default;
LandmarkSearch::LandmarkSearch(LandmarkSearch&&) noexcept = default;
LandmarkSearch& LandmarkSearch::operator=(LandmarkSearch&&) noexcept = default;

std::vector<RoughLandmark> LandmarkSearch::look(const cv::Mat& lower, const cv::Mat& upper,
                                                const std::optional<FrameMotion>& motion) const {
  check_image("LandmarkSearch", "lower", lower, impl_->views[0].size());
  check_image("LandmarkSearch", "upper", upper, impl_->views[1].size());
  const std::array<std::vector<Found>, 2> found{impl_->views[0].finder().find(lower, impl_->table, impl_->wanted),
                                                impl_->views[1].finder().find(upper, impl_->table, impl_->wanted)};
  std::vector<RoughLandmark> things = impl_->banded_things(lower, upper, motion);
  for (std::size_t hue = 0; hue < impl_->wanted.size(); ++hue) {
    std::vector<const Candidate*> taken;
    const auto is_taken = [&taken](const Candidate* c) { return std::ranges::find(taken, c) != taken.end(); };
    for (const Impl::Pair& pair : impl_->pairs_of(found[0][hue], found[1][hue])) {
      if (is_taken(pair[0]) || is_taken(pair[1])) continue;
      auto thing = impl_->thing_of(pair, hue, motion);
      if (!thing) continue;
      taken.insert(taken.end(), pair.begin(), pair.end());
      things.push_back(std::move(*thing));
    }
  }
  return things;
}

}  // namespace twocone::vision

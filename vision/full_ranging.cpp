// SPDX-License-Identifier: Apache-2.0
#include "vision/full_ranging.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "vision/full/colour_table.h"
#include "vision/full/finder.h"
#include "vision/full/outline_fit.h"
#include "vision/target_colours.h"
#include "vision/triangulation.h"

namespace twocone::vision {
namespace {

// The finder's places are good to a pixel or two; the first fit takes in so much.
constexpr double kCoarseReach_px = 4;
constexpr double kCoarseBlur_px = 3;
constexpr double kMostBlur_px = 6;
constexpr int kFineRounds = 1;
constexpr double kCoarse_px = 0.05;
constexpr int kCoarseStride = 3;
constexpr int kMostBeyond_px = 4;
constexpr double kConverged_px = 1e-5;
// Landmark and background colours are taken so far from the outline, beyond the blur.
constexpr double kFineReach_px = 0.3;
// Where pixels are noisy, in grey levels squared, and that is most of what the edges scatter by, more of them make a
// colour: else what colours err by is how light and background change from pixel to pixel, and fewer are truer.
constexpr double kNoisyVariance = 1;
constexpr double kNoisyShare = 0.5;
constexpr int kManySamples = 12;
// By so much the edges scatter more than the noise of their pixels explains before the rest is laid on pixels that are
// no means over their areas.
constexpr double kSureOfSampling = 1.5;
// Sides begin where they are so far apart, in pixels, or at this radius.
constexpr double kLeastRadius_px = 10;
constexpr double kLeastWidth_px = 1.5;
constexpr double kLeastArcSupport = 0.6;
constexpr double kLeastSideSupport = 0.25;
// A landmark seen narrower than it is, is partly hidden.
constexpr double kNarrow_px = 0.5;
constexpr double kNarrowSigmas = 5;
// What hides a part of it in one view, the rig's own mast above all, may hide it in the other too. A landmark that is
// narrower than this there does not show it.
constexpr double kTellingWidth_px = 8;
constexpr double kSameBearing_rad = 4 * std::numbers::pi / 180;
constexpr double kRivalArea = 0.3;
// Of the top's place, for a rim of one pixel's radius, falling with its square: as found without noise, at radii of 4
// and 8 pixels (full_statistics_test.cpp).
constexpr double kCurvedError_px = 0.05;
constexpr double kLeastScatter = 0.25;
constexpr double kOddScatter = 1.5;     // of an outline against that of all: more is its own
constexpr double kOddNarrowness = 4;    // of its variance: two sigmas
constexpr double kRounding = 1.0 / 12;  // of grey levels to whole ones

double wrap(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

void check(const std::vector<Target>& targets) {
  std::string bad;
  for (const Target& target : targets) {
    if (!(target.radius_m > 0) || !std::isfinite(target.radius_m)) {
      bad += fmt::format(" radius of '{}' is {} m, must be > 0;", target.name, target.radius_m);
    }
    if (target.top_m && !(std::isfinite(*target.top_m) && *target.top_m > 0)) {
      bad += fmt::format(" top of '{}' is {} m, must be > 0;", target.name, *target.top_m);
    }
  }
  if (!bad.empty()) throw std::invalid_argument("method full:" + bad);
}

void check_picture(const char* view, const cv::Mat& picture, cv::Size size) {
  if (picture.type() != CV_8UC3 || picture.size() != size) {
    throw std::invalid_argument(
        fmt::format("FullRanging: the {} picture has {} x {} pixels of {} channels, wanted {} x {} of r g b", view,
                    picture.cols, picture.rows, picture.channels(), size.width, size.height));
  }
}

}  // namespace

class FullRanging::Impl {
 public:
  Impl(const Rig& rig, const std::vector<Target>& targets, cv::Size lower_size, cv::Size upper_size)
      : rig_(rig),
        targets_(targets),
        table_(colours_of(targets)),
        views_{View{rig_.lower, lower_size, Finder(rig_.lower, lower_size)},
               View{rig_.upper, upper_size, Finder(rig_.upper, upper_size)}} {
    check(targets);
  }

  [[nodiscard]] std::vector<RangeMeasurement> measure(const cv::Mat& lower, const cv::Mat& upper) const {
    check_picture("lower", lower, views_[0].size);
    check_picture("upper", upper, views_[1].size);
    const std::array<const cv::Mat*, 2> pictures{&lower, &upper};
    const std::array<Found, 2> found{views_[0].finder.find(lower, table_, targets_.size()),
                                     views_[1].finder.find(upper, table_, targets_.size())};
    std::vector<Seen> all(targets_.size());
    Stations stations;  // one for all fits, so that its room is made once
    for (std::size_t k = 0; k < targets_.size(); ++k) all[k] = begin(k, found, pictures, stations);
    for (std::size_t view = 0; view < 2; ++view) finish(view, *pictures[view], all, stations);
    std::vector<RangeMeasurement> measurements;
    for (std::size_t k = 0; k < targets_.size(); ++k) measurements.push_back(conclude(k, all[k]));
    return measurements;
  }

 private:
  using Found = std::vector<std::vector<Candidate>>;

  struct View {
    const MirrorView& mirror;
    cv::Size size;
    Finder finder;
  };

  /// One landmark in one view, on the way to its sighting.
  struct Look {
    bool is_found = false;
    bool is_truncated = false;
    bool is_saturated = false;
    std::optional<OutlineFit> fit;
    bool is_occluded = false;  // the top cannot be trusted
    bool is_narrow = false;    // its bearing cannot be trusted
    std::optional<Sighting> sighting;
  };
  struct Seen {
    std::array<Look, 2> looks;
    double top_m = 0;
    bool has_rivals = false;
  };

  [[nodiscard]] Eigen::Vector2d pixel_of(std::size_t view, const Candidate& c) const {
    return views_[view].mirror.settings().centre_px +
           Eigen::Vector2d(c.top_px * std::cos(c.angle_rad), c.top_px * std::sin(c.angle_rad));
  }

  /// Where a candidate's ray has the height `top_m`.
  [[nodiscard]] std::optional<Cylinder> place(std::size_t view, const Candidate& c, double radius_m,
                                              double top_m) const {
    const auto ray = views_[view].mirror.back_project(pixel_of(view, c));
    if (!ray || !(ray->direction.z() > 0)) return std::nullopt;
    const double way = (top_m - ray->origin_m.z()) / ray->direction.z();
    if (!(way > 0)) return std::nullopt;
    const Eigen::Vector3d near = ray->origin_m + way * ray->direction;
    return Cylinder{near.head<2>().norm() + radius_m, std::atan2(near.y(), near.x()), radius_m, top_m};
  }

  [[nodiscard]] double bearing_of(std::size_t view, const Candidate& c) const {
    // Half way up, where every candidate lies in the mirror.
    const Eigen::Vector2d& centre_px = views_[view].mirror.settings().centre_px;
    const auto ray = views_[view].mirror.back_project(centre_px + (pixel_of(view, c) - centre_px) / 2);
    return ray ? std::atan2(ray->direction.y(), ray->direction.x()) : 0.0;
  }

  /// Chooses candidates of both views that may be one landmark, and fits each coarsely.
  [[nodiscard]] Seen begin(std::size_t k, const std::array<Found, 2>& found,
                           const std::array<const cv::Mat*, 2>& pictures, Stations& stations) const {
    Seen seen;
    if (table_.is_ambiguous(k)) return seen;
    std::array<const Candidate*, 2> chosen{};
    for (std::size_t view = 0; view < 2; ++view) {
      const auto& candidates = found[view][k];
      if (candidates.empty()) continue;
      chosen[view] = &candidates.front();
      seen.has_rivals =
          seen.has_rivals || (candidates.size() > 1 && candidates[1].area_px > kRivalArea * candidates[0].area_px);
    }
    if (chosen[0] != nullptr && chosen[1] != nullptr &&
        std::abs(wrap(bearing_of(0, *chosen[0]) - bearing_of(1, *chosen[1]))) > kSameBearing_rad) {
      seen.has_rivals = true;
    }
    if (seen.has_rivals) return seen;

    const Target& target = targets_[k];
    std::optional<double> top_m = target.top_m;
    if (!top_m && chosen[0] != nullptr && chosen[1] != nullptr) {
      Sighting lower;
      Sighting upper;
      lower.pixel_px = pixel_of(0, *chosen[0]);
      upper.pixel_px = pixel_of(1, *chosen[1]);
      top_m = triangulate(rig_, &lower, &upper, target.radius_m, std::nullopt).top_m;
    }
    for (std::size_t view = 0; view < 2; ++view) {
      if (chosen[view] == nullptr) continue;
      Look& look = seen.looks[view];
      look.is_found = true;
      look.is_truncated = chosen[view]->at_rim;
      if (look.is_truncated || !top_m) continue;
      const auto start = place(view, *chosen[view], target.radius_m, *top_m);
      if (!start) continue;
      seen.top_m = *top_m;
      // A thin landmark is found by its own width: blurred further, it is gone.
      const double width_px = 2 * chosen[view]->top_px * target.radius_m / start->range_m;
      const double blur_px = std::clamp(width_px / 2, 1.0, kCoarseBlur_px);
      look.fit = fit(view, k, *pictures[view], *start, {kCoarseReach_px - kCoarseBlur_px + blur_px, blur_px},
                     PixelNoise{}, {blur_px, kMostBlur_px, kCoarse_px}, look, stations);
      if (look.fit) follow_colour(k, *pictures[view], *look.fit);
      if (look.fit) {
        look.fit = fit(view, k, *pictures[view], look.fit->cylinder, reach_of(look.fit->blur), PixelNoise{},
                       {1, kMostBlur_px, kCoarse_px}, look, stations);
      }
    }
    return seen;
  }

  /// A thin landmark's fit may come to rest below its top: where its colour goes on beyond, so does the cylinder.
  void follow_colour(std::size_t k, const cv::Mat& picture, OutlineFit& fit) const {
    const Outline::Vertex& near = fit.outline.near();
    const double per_m = near.by_range_pxpm.norm();
    const Eigen::Vector2d out = -near.by_range_pxpm / per_m;
    const Eigen::Vector2d top =
        near.pixel_px + near.by_range_pxpm * fit.step.x() + near.by_bearing_pxprad * fit.step.y();
    int beyond = 0;
    for (int i = 0; i < kMostBeyond_px; ++i) {
      const Eigen::Vector2d p = top + (i + 1) * out;
      const cv::Point pixel(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
      if (!cv::Rect({0, 0}, picture.size()).contains(pixel)) break;
      if (table_.label(picture.ptr<std::uint8_t>(pixel.y) + std::ptrdiff_t(3) * pixel.x) != k + 1) break;
      beyond = i + 1;
    }
    if (beyond > 0)
      fit.cylinder.range_m = std::max(fit.cylinder.range_m - beyond / per_m, 1.01 * fit.cylinder.radius_m);
  }

  /// Clear of the edge, whose half support is 0.7 of its width across a pixel's corner.
  static Reach reach_of(double blur_px) { return {kFineReach_px + 0.7 * blur_px, blur_px}; }
  /// The same where pixels are noisy.
  static Reach long_reach_of(double blur_px) { return {kFineReach_px + 0.7 * blur_px, blur_px, kManySamples}; }

  /// Where the sides begin: where they are kLeastWidth_px apart, but for a thin landmark half way up.
  static double least_radius_px(const MirrorView& mirror, const Cylinder& c) {
    const double wedge_rad = 2 * std::asin(std::min(0.9, c.radius_m / std::max(c.range_m, 1e-9)));
    const double wide_px = std::max(kLeastRadius_px, kLeastWidth_px / wedge_rad);
    const auto top =
        mirror.project({c.range_m * std::cos(c.bearing_rad), c.range_m * std::sin(c.bearing_rad), c.top_m});
    return top ? std::min(wide_px, (*top - mirror.settings().centre_px).norm() / 2) : wide_px;
  }

  [[nodiscard]] std::optional<OutlineFit> fit(std::size_t view, std::size_t k, const cv::Mat& picture,
                                              const Cylinder& cylinder, const Reach& reach, const PixelNoise& noise,
                                              const FitLimits& limits, Look& look, Stations& stations) const {
    const MirrorView& mirror = views_[view].mirror;
    const auto outline = make_outline(mirror, cylinder, least_radius_px(mirror, cylinder));
    if (!outline) {
      look.is_truncated = true;
      return std::nullopt;
    }
    read_stations(picture, table_, static_cast<std::uint8_t>(k + 1), *outline, reach,
                  limits.converged_px < kCoarse_px ? 1 : kCoarseStride, stations);
    look.is_saturated = stations.too_bright * 2 > static_cast<int>(stations.stations.size());
    return fit_outline(stations, cylinder, *outline, noise, limits);
  }

  /// Median over a view's landmarks; nothing without any.
  template <typename Value>
  static std::optional<double> median_of(std::size_t view, const std::vector<Seen>& all, Value value) {
    std::vector<double> values;
    for (const Seen& seen : all) {
      if (seen.looks[view].fit) values.push_back(value(*seen.looks[view].fit));
    }
    if (values.empty()) return std::nullopt;
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }

  /// Fits all landmarks of a view again with the noise that they have in common, and makes sightings.
  void finish(std::size_t view, const cv::Mat& picture, std::vector<Seen>& all, Stations& stations) const {
    double residual = 0;
    double grey = 0;
    double spread = 0;
    for (const Seen& seen : all) {
      if (const auto& fit = seen.looks[view].fit) {
        residual += fit->residual;
        grey += fit->grey;
        spread += fit->spread;
      }
    }
    PixelNoise noise;
    const auto code_variance = median_of(view, all, [](const OutlineFit& f) { return f.code_variance; });
    if (!code_variance) return;
    noise.code_variance = std::max(*code_variance, kRounding);
    // The lens's, so it is the same for all.
    const double blur_px = *median_of(view, all, [](const OutlineFit& f) { return f.blur; });
    const bool is_noisy = noise.code_variance > kNoisyVariance && noise.code_variance * grey > kNoisyShare * residual;
    const Reach reach = is_noisy ? long_reach_of(blur_px) : reach_of(blur_px);
    const double explained = kSureOfSampling * noise.code_variance * grey;
    if (spread > 0) noise.sampling = std::clamp((residual - explained) / spread, 1e-6, 1.0);
    Scores arc;
    Scores sides;
    const auto add = [](Scores& sum, const Scores& one) {
      sum.found += one.found;
      sum.expected += one.expected;
    };
    for (std::size_t k = 0; k < all.size(); ++k) {
      Look& look = all[k].looks[view];
      if (!look.fit) continue;
      for (int round = 0; round < kFineRounds && look.fit; ++round) {
        look.fit =
            fit(view, k, picture, look.fit->cylinder, reach, noise, {blur_px, blur_px, kConverged_px}, look, stations);
      }
      if (!look.fit) continue;
      add(arc, look.fit->arc_scores);
      add(sides, look.fit->side_scores);
    }
    for (Seen& seen : all) {
      Look& look = seen.looks[view];
      if (!look.fit) continue;
      const OutlineFit& fit = *look.fit;
      look.is_occluded = fit.arc_support < kLeastArcSupport;
      look.is_narrow = std::min(fit.left_support, fit.right_support) < kLeastSideSupport ||
                       fit.narrowness_px > std::max(kNarrow_px, kNarrowSigmas * fit.sigma_narrowness_px);
      if (look.is_occluded) continue;
      look.sighting = sighting_of(fit, scatter(arc, fit.arc_scores), scatter(sides, fit.side_scores));
    }
  }

  /// How much wider than the noise model says a landmark's place scatters: as all landmarks' outlines do, or more where
  /// its own does.
  static double scatter(const Scores& all, const Scores& own) {
    const double common = all.expected > 0 ? std::max(all.found / all.expected, kLeastScatter) : 1;
    const double alone = own.expected > 0 ? own.found / own.expected : 0;
    return alone > kOddScatter * common ? alone : common;
  }

  [[nodiscard]] static std::optional<Sighting> sighting_of(const OutlineFit& fit, double arc_scatter,
                                                           double side_scatter) {
    // The arc tells the range, the sides the bearing.
    const Eigen::Vector2d root(std::sqrt(arc_scatter), std::sqrt(side_scatter));
    Eigen::Matrix2d covariance = root.asDiagonal() * fit.information.inverse() * root.asDiagonal();
    // Sides that are farther apart, or nearer, than noise explains: something beside one of them passes for the
    // landmark or hides it, and which of the two is not known.
    const double noise_px2 = side_scatter * fit.sigma_narrowness_px * fit.sigma_narrowness_px;
    const double narrow_px2 = fit.narrowness_px * fit.narrowness_px;
    const double excess_px2 = narrow_px2 > kOddNarrowness * noise_px2 ? narrow_px2 - noise_px2 : 0;
    const double bearing_px = fit.outline.near().by_bearing_pxprad.norm();
    covariance(1, 1) += excess_px2 / 4 / (bearing_px * bearing_px);
    // Pixels are taken to be cut by straight edges; what a rim curves within a pixel is left after its mean is allowed
    // for.
    const double half_px = rim_width_px(fit) / 2;
    const double curved_px = kCurvedError_px / (half_px * half_px);
    const double range_px = fit.outline.near().by_range_pxpm.norm();
    covariance(0, 0) += curved_px * curved_px / (range_px * range_px);
    if (!covariance.allFinite() || !(covariance.determinant() > 0)) return std::nullopt;
    const Outline::Vertex& near = fit.outline.near();
    Eigen::Matrix2d by_place;
    by_place << near.by_range_pxpm, near.by_bearing_pxprad;
    Sighting sighting;
    sighting.pixel_px = near.pixel_px + by_place * fit.step;
    sighting.covariance_px2 = by_place * covariance * by_place.transpose();
    const double information = fit.arc_scores.expected / arc_scatter + fit.side_scores.expected / side_scatter;
    sighting.edge_noise_px = std::sqrt(fit.length_px / information);
    return sighting;
  }

  static double rim_width_px(const OutlineFit& fit) { return fit.outline.vertices[Outline::kSideSegments].chord_px; }

  /// Its colour is there, and its outline is not.
  static bool is_part_hidden(const Look& look) {
    return look.is_found && !look.sighting && !look.is_truncated && !look.is_saturated;
  }

  [[nodiscard]] RangeMeasurement conclude(std::size_t k, const Seen& seen) const {
    RangeMeasurement m;
    const Look& lower = seen.looks[0];
    const Look& upper = seen.looks[1];
    if (table_.is_ambiguous(k)) {
      m.verdict = RangeVerdict::kSameColour;
      return m;
    }
    if (seen.has_rivals) {
      m.verdict = RangeVerdict::kTwoCandidates;
      return m;
    }
    m.lower_sighting = lower.sighting;
    m.upper_sighting = upper.sighting;
    if (lower.sighting) m.lower_px = lower.sighting->pixel_px;
    if (upper.sighting) m.upper_px = upper.sighting->pixel_px;
    const Target& target = targets_[k];
    const Triangulation t = triangulate(rig_, lower.sighting ? &*lower.sighting : nullptr,
                                        upper.sighting ? &*upper.sighting : nullptr, target.radius_m, target.top_m);
    m.verdict = t.verdict;
    if (t.verdict == RangeVerdict::kNotSeen) {
      const auto any = [&](auto what) { return what(lower) || what(upper); };
      if (any([](const Look& l) { return l.is_saturated; })) {
        m.verdict = RangeVerdict::kSaturated;
      } else if (any([](const Look& l) { return l.is_occluded; })) {
        m.verdict = RangeVerdict::kOccluded;
      } else if (any([](const Look& l) { return l.is_truncated; })) {
        m.verdict = RangeVerdict::kTruncated;
      } else if (any([](const Look& l) { return l.is_found; })) {
        m.verdict = RangeVerdict::kNoMatch;
      }
      return m;
    }
    const bool is_narrow = (lower.sighting && lower.is_narrow) || (upper.sighting && upper.is_narrow);
    if (t.verdict == RangeVerdict::kOneView) {
      // No other view tells whether the top is whole.
      const Look& shown = lower.sighting ? lower : upper;
      const Look& other = lower.sighting ? upper : lower;
      if (is_narrow || (is_part_hidden(other) && rim_width_px(*shown.fit) < kTellingWidth_px)) {
        m.verdict = RangeVerdict::kOccluded;
        return m;
      }
    }
    m.range_m = t.range_m;
    m.bearing_rad = t.bearing_rad;
    m.covariance = t.covariance;
    m.disparity_px = t.disparity_px;
    if (t.covariance) {
      m.sigma_range_m = std::sqrt((*t.covariance)(0, 0));
      m.sigma_bearing_rad = std::sqrt((*t.covariance)(1, 1));
    }
    if (is_narrow) {
      m.verdict = RangeVerdict::kOccluded;
      m.bearing_rad.reset();
      m.sigma_bearing_rad.reset();
    }
    return m;
  }

  Rig rig_;
  std::vector<Target> targets_;
  ColourTable table_;
  std::array<View, 2> views_;
};

FullRanging::FullRanging(const Rig& rig, const std::vector<Target>& targets, cv::Size lower_size, cv::Size upper_size)
    : impl_(std::make_unique<Impl>(rig, targets, lower_size, upper_size)) {}
FullRanging::~FullRanging() = default;
FullRanging::FullRanging(FullRanging&&) noexcept = default;
FullRanging& FullRanging::operator=(FullRanging&&) noexcept = default;

std::vector<RangeMeasurement> FullRanging::measure(const cv::Mat& lower, const cv::Mat& upper) const {
  return impl_->measure(lower, upper);
}

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#include "vision/full/view_fitter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

namespace twocone::vision {
namespace {

// The finder's places are good to a pixel or two; the first fit takes in so much.
constexpr double kCoarseReach_px = 4;
constexpr double kCoarseBlur_px = 3;
constexpr double kMostBlur_px = 6;
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
// A landmark seen narrower than it is, is partly hidden; one seen wider is not where its top says.
constexpr double kNarrow_px = 0.5;
constexpr double kNarrowSigmas = 5;
// Of the top's place, for a rim of one pixel's radius, falling with its square: as found without noise, at radii of 4
// and 8 pixels (full_statistics_test.cpp).
constexpr double kCurvedError_px = 0.05;
constexpr double kLeastScatter = 0.25;
constexpr double kOddScatter = 1.5;     // of an outline against that of all: more is its own
constexpr double kOddNarrowness = 4;    // of its variance: two sigmas
constexpr double kRounding = 1.0 / 12;  // of grey levels to whole ones

// Of the finder's top, for a landmark of some width there, in pixels: sqrt(a^2 + (b / width)^2) out from the tip and
// across. Out: whole circles (0.29) of whole pixels. Across: 0.1, and another 0.1 because a side in shadow loses its
// colour. As found in synthetic pictures of 160 x 120 to 960 x 720 (full_stages_test.cpp), the shadow's in rendered
// ones of the lab.
constexpr double kFoundOut_px = 0.38;
constexpr double kFoundOutThin_px2 = 0.5;
constexpr double kFoundAcross_px = 0.15;
constexpr double kFoundAcrossThin_px2 = 0.5;
// The outermost circle of the colour is where the rim's middle third ends: so much of the radius behind the near point,
// 1 - sqrt(1 - 1/9).
constexpr double kBehindNear = 0.0572;
// An expected place is good to this; beyond it the outline is fitted again from where it was, and far beyond it the
// place was wrong.
constexpr double kExpectedReach_px = 0.5;
constexpr double kExpectedFar_px = 2;
constexpr int kExpectedRounds = 2;
// Newton's steps shrink faster than tenfold: what is left is below 1e-3 px.
constexpr double kExpectedConverged_px = 1e-2;
// An expected outline is first read for edges as wide as this; wider ones are looked for as without.
constexpr double kNearBlur_px = 2;

/// Clear of the edge, whose half support is 0.7 of its width across a pixel's corner.
Reach reach_of(double blur_px) { return {kFineReach_px + 0.7 * blur_px, blur_px}; }
/// The same where pixels are noisy.
Reach long_reach_of(double blur_px) { return {kFineReach_px + 0.7 * blur_px, blur_px, kManySamples}; }

/// Where the sides begin: where they are kLeastWidth_px apart, but for a thin landmark half way up.
double least_radius_px(const MirrorView& mirror, const Cylinder& c) {
  const double wedge_rad = 2 * std::asin(std::min(0.9, c.radius_m / std::max(c.range_m, 1e-9)));
  const double wide_px = std::max(kLeastRadius_px, kLeastWidth_px / wedge_rad);
  const auto top = mirror.project({c.range_m * std::cos(c.bearing_rad), c.range_m * std::sin(c.bearing_rad), c.top_m});
  return top ? std::min(wide_px, (*top - mirror.settings().centre_px).norm() / 2) : wide_px;
}

/// How much wider than the noise model says a landmark's place scatters: as all landmarks' outlines do, or more where
/// its own does.
double scatter(const Scores& all, const Scores& own) {
  const double common = all.expected > 0 ? std::max(all.found / all.expected, kLeastScatter) : 1;
  const double alone = own.expected > 0 ? own.found / own.expected : 0;
  return alone > kOddScatter * common ? alone : common;
}

std::optional<Sighting> sighting_of(const OutlineFit& fit, double arc_scatter, double side_scatter) {
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

double step_px(const OutlineFit& fit) {
  return std::hypot(fit.outline.near().by_range_pxpm.norm() * fit.step.x(),
                    fit.outline.near().by_bearing_pxprad.norm() * fit.step.y());
}

}  // namespace

double rim_width_px(const OutlineFit& fit) { return fit.outline.vertices[Outline::kSideSegments].chord_px; }

// A thin landmark's fit may come to rest below its top: where its colour goes on beyond, so does the cylinder.
void ViewFitter::follow_colour(std::size_t k, const cv::Mat& picture, OutlineFit& fit) const {
  const Outline::Vertex& near = fit.outline.near();
  const double per_m = near.by_range_pxpm.norm();
  const Eigen::Vector2d out = -near.by_range_pxpm / per_m;
  const Eigen::Vector2d top = near.pixel_px + near.by_range_pxpm * fit.step.x() + near.by_bearing_pxprad * fit.step.y();
  int beyond = 0;
  for (int i = 0; i < kMostBeyond_px; ++i) {
    const Eigen::Vector2d p = top + (i + 1) * out;
    const cv::Point pixel(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
    if (!cv::Rect({0, 0}, picture.size()).contains(pixel)) break;
    if (table_.label(picture.ptr<std::uint8_t>(pixel.y) + std::ptrdiff_t(3) * pixel.x) != k + 1) break;
    beyond = i + 1;
  }
  if (beyond > 0) fit.cylinder.range_m = std::max(fit.cylinder.range_m - beyond / per_m, 1.01 * fit.cylinder.radius_m);
}

Eigen::Vector2d ViewFitter::pixel_of(const Candidate& c) const {
  return mirror_.settings().centre_px +
         Eigen::Vector2d(c.top_px * std::cos(c.angle_rad), c.top_px * std::sin(c.angle_rad));
}

std::optional<Cylinder> ViewFitter::place(const Candidate& c, double radius_m, double top_m) const {
  const auto ray = mirror_.back_project(pixel_of(c));
  if (!ray || !(ray->direction.z() > 0)) return std::nullopt;
  const double way = (top_m - ray->origin_m.z()) / ray->direction.z();
  if (!(way > 0)) return std::nullopt;
  const Eigen::Vector3d near = ray->origin_m + way * ray->direction;
  return Cylinder{near.head<2>().norm() + radius_m, std::atan2(near.y(), near.x()), radius_m, top_m};
}

double ViewFitter::bearing_of(const Candidate& c) const {
  const Eigen::Vector2d& centre_px = mirror_.settings().centre_px;
  const auto ray = mirror_.back_project(centre_px + (pixel_of(c) - centre_px) / 2);
  return ray ? std::atan2(ray->direction.y(), ray->direction.x()) : 0.0;
}

std::optional<Sighting> ViewFitter::found(const Candidate& c, double radius_m, double top_m) const {
  const auto ray = mirror_.back_project(pixel_of(c));
  if (!ray || !(ray->direction.z() > 0)) return std::nullopt;
  const double way = (top_m - ray->origin_m.z()) / ray->direction.z();
  if (!(way > 0)) return std::nullopt;
  Eigen::Vector3d top_of_circle = ray->origin_m + way * ray->direction;
  top_of_circle.head<2>() -= kBehindNear * radius_m * ray->direction.head<2>().normalized();
  const auto near_px = mirror_.project(top_of_circle);
  if (!near_px) return std::nullopt;
  const Eigen::Vector2d out = (*near_px - mirror_.settings().centre_px).normalized();
  const Eigen::Vector2d across(-out.y(), out.x());
  const double width_px = 2 * c.top_px * radius_m / (top_of_circle.head<2>().norm() + radius_m);
  const double out_px = std::hypot(kFoundOut_px, kFoundOutThin_px2 / width_px);
  const double across_px = std::hypot(kFoundAcross_px, kFoundAcrossThin_px2 / width_px);
  Sighting sighting;
  sighting.pixel_px = *near_px;
  sighting.covariance_px2 =
      out_px * out_px * out * out.transpose() + across_px * across_px * across * across.transpose();
  return sighting;
}

std::optional<OutlineFit> ViewFitter::fit(std::size_t k, const cv::Mat& picture, const Cylinder& cylinder,
                                          const Reach& reach, const PixelNoise& noise, const FitLimits& limits,
                                          int stride, Look& look, Stations& stations) const {
  const auto outline = make_outline(mirror_, cylinder, least_radius_px(mirror_, cylinder));
  if (!outline) {
    look.is_truncated = true;
    return std::nullopt;
  }
  read_stations(picture, table_, static_cast<std::uint8_t>(k + 1), *outline, reach, stride, stations);
  look.is_saturated = stations.too_bright * 2 > static_cast<int>(stations.stations.size());
  return fit_outline(stations, cylinder, *outline, noise, limits);
}

namespace {

void keep_pool(Look& look) {
  if (const auto& fit = look.fit) look.pool = {fit->residual, fit->grey, fit->spread, fit->code_variance, fit->blur};
}

}  // namespace

void ViewFitter::fit_coarse(std::size_t k, const cv::Mat& picture, const Cylinder& start, Look& look,
                            Stations& stations) const {
  // A thin landmark is found by its own width: blurred further, it is gone.
  const double width_px = 2 * look.candidate->top_px * start.radius_m / start.range_m;
  const double blur_px = std::clamp(width_px / 2, 1.0, kCoarseBlur_px);
  look.fit = fit(k, picture, start, {kCoarseReach_px - kCoarseBlur_px + blur_px, blur_px}, PixelNoise{},
                 {blur_px, kMostBlur_px, kCoarse_px}, kCoarseStride, look, stations);
  if (!look.fit) return;
  follow_colour(k, picture, *look.fit);
  look.fit = fit(k, picture, look.fit->cylinder, reach_of(look.fit->blur), PixelNoise{}, {1, kMostBlur_px, kCoarse_px},
                 kCoarseStride, look, stations);
  keep_pool(look);
}

bool ViewFitter::fit_near(std::size_t k, const cv::Mat& picture, const Cylinder& start, Look& look,
                          Stations& stations) const {
  Look tried = look;
  tried.fit = fit(k, picture, start, reach_of(kNearBlur_px), PixelNoise{}, {1, kMostBlur_px, kCoarse_px}, kCoarseStride,
                  tried, stations);
  if (!tried.fit || tried.fit->blur > kNearBlur_px || step_px(*tried.fit) > kExpectedReach_px) return false;
  keep_pool(tried);
  look = std::move(tried);
  return true;
}

std::optional<ViewFitter::Common> ViewFitter::common(const std::vector<const Look*>& looks) {
  double residual = 0;
  double grey = 0;
  double spread = 0;
  std::vector<double> code_variances;
  std::vector<double> blurs;
  for (const Look* look : looks) {
    if (!look->pool) continue;
    residual += look->pool->residual;
    grey += look->pool->grey;
    spread += look->pool->spread;
    code_variances.push_back(look->pool->code_variance);
    blurs.push_back(look->pool->blur);
  }
  if (blurs.empty()) return std::nullopt;
  const auto median_of = [](std::vector<double>& values) {
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  Common common;
  common.noise.code_variance = std::max(median_of(code_variances), kRounding);
  // The lens's, so it is the same for all.
  common.blur_px = median_of(blurs);
  const double code_variance = common.noise.code_variance;
  const bool is_noisy = code_variance > kNoisyVariance && code_variance * grey > kNoisyShare * residual;
  common.reach = is_noisy ? long_reach_of(common.blur_px) : reach_of(common.blur_px);
  const double explained = kSureOfSampling * code_variance * grey;
  if (spread > 0) common.noise.sampling = std::clamp((residual - explained) / spread, 1e-6, 1.0);
  return common;
}

void ViewFitter::fit_fine(std::size_t k, const cv::Mat& picture, const Common& common, Look& look,
                          Stations& stations) const {
  look.is_fine = true;
  look.fit = fit(k, picture, look.fit->cylinder, common.reach, common.noise,
                 {common.blur_px, common.blur_px, kConverged_px}, 1, look, stations);
}

bool ViewFitter::fit_expected(std::size_t k, const cv::Mat& picture, const Cylinder& expected, const Common& common,
                              Look& look, Stations& stations) const {
  Look tried = look;
  tried.is_fine = true;
  Cylinder start = expected;
  for (int round = 0; round < kExpectedRounds; ++round) {
    tried.fit = fit(k, picture, start, common.reach, common.noise,
                    {common.blur_px, common.blur_px, kExpectedConverged_px}, 1, tried, stations);
    if (!tried.fit) return false;
    const double step = step_px(*tried.fit);
    if (step <= kExpectedReach_px) {
      look = std::move(tried);
      return true;
    }
    if (step > kExpectedFar_px) return false;
    start = tried.fit->cylinder;
  }
  return false;
}

std::vector<Judged> ViewFitter::judge(const std::vector<const Look*>& looks) {
  // Coarse and fine fits each among themselves.
  std::array<Scores, 2> arc;
  std::array<Scores, 2> sides;
  const auto add = [](Scores& sum, const Scores& one) {
    sum.found += one.found;
    sum.expected += one.expected;
  };
  for (const Look* look : looks) {
    if (!look->fit) continue;
    add(arc[look->is_fine ? 1 : 0], look->fit->arc_scores);
    add(sides[look->is_fine ? 1 : 0], look->fit->side_scores);
  }
  std::vector<Judged> judged(looks.size());
  for (std::size_t i = 0; i < looks.size(); ++i) {
    if (!looks[i]->fit) continue;
    const OutlineFit& fit = *looks[i]->fit;
    const std::size_t stage = looks[i]->is_fine ? 1 : 0;
    judged[i].is_occluded = fit.arc_support < kLeastArcSupport;
    const double off_px = std::max(kNarrow_px, kNarrowSigmas * fit.sigma_narrowness_px);
    judged[i].is_narrow =
        std::min(fit.left_support, fit.right_support) < kLeastSideSupport || fit.narrowness_px > off_px;
    judged[i].is_wide = fit.narrowness_px < -off_px;
    if (judged[i].is_occluded) continue;
    judged[i].sighting = sighting_of(fit, scatter(arc[stage], fit.arc_scores), scatter(sides[stage], fit.side_scores));
  }
  return judged;
}
}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#include "vision/outline/view_fitter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "base/quantile.h"

namespace twocone::vision {
namespace {

// In vision/outline/, "no test fixes it" means that no test determines the value. tests/evidence/behaviour.sh still
// notices any change of results.

// Reach of the first coarse fit. It allows for the finder's positions, which are accurate to a pixel or two.
// Tuned by hand on synthetic images; no test fixes it.
constexpr double kCoarseReach_px = 4;
// Lower limit of the edges' width in the first coarse fit of a wide landmark.
// Tuned by hand on synthetic images; no test fixes it.
constexpr double kCoarseBlur_px = 3;
// Upper limit of the edges' width in coarse fits. Tuned by hand on synthetic images; no test fixes it.
constexpr double kMostBlur_px = 6;
// Coarse fits stop at a step below this. Tuned by hand on synthetic images; no test fixes it.
constexpr double kCoarse_px = 0.05;
// Coarse fits read every third row and column. Tuned by hand on synthetic images. outline_stages_test.cpp,
// EachIsMoreAccurateThanTheOneBefore and CoarseKnowsHowFarItIsOff, limits the error that results but does not fix the
// value.
constexpr int kCoarseStride = 3;
// Longest search for the landmark's colour beyond the top of a coarse fit (follow_colour).
// Tuned by hand on synthetic images; no test fixes it.
constexpr int kMostBeyond_px = 4;
// The bands' finder is accurate to half a pixel or so; a longer step leads to another band's edge. Tuned by hand on
// synthetic images; no test fixes it.
constexpr double kBandsReach_px = 2;
// Fine fits stop at a step below this. Tuned by hand on synthetic images; no test fixes it.
constexpr double kConverged_px = 1e-5;
// A fine fit whose step is longer is repeated from its answer, at most kFineRounds times in all: the outline bends less
// than a hundredth of a pixel over the step then, and the pixels that were read lie on both sides of the answer. Tuned
// by hand on rendered images of the lab; no test fixes the two values.
constexpr double kFineStep_px = 0.3;
constexpr int kFineRounds = 3;
// Distance from the outline, beyond the blur, at which the colours of landmark and background are read.
// Tuned by hand on synthetic images; no test fixes it.
constexpr double kFineReach_px = 0.3;
// Where pixels are noisy, a colour is the mean of more pixels. This needs both a noise variance above kNoisyVariance,
// in grey levels squared, and noise that causes more than kNoisyShare of the edges' scatter. Elsewhere the error of a
// colour comes from light and background that change from pixel to pixel, and fewer pixels are more accurate. The three
// values are tuned by hand on synthetic images; outline_statistics_test.cpp,
// EllipsesHoldTheTruthAndTheErrorIsNearTheBound, with TWOCONE_POSES=2000 limits the error that results but does not fix
// them. They came in together with that test's limit of 1.3.
constexpr double kNoisyVariance = 1;
constexpr double kNoisyShare = 0.5;
constexpr int kManySamples = 12;
// The scatter of the edges must exceed the part explained by pixel noise by this factor before the rest is attributed
// to pixels that are not means over their areas. Tuned by hand on synthetic images; no test fixes it.
constexpr double kSureOfSampling = 1.5;
// The sides begin at this radius, or where they are kLeastWidth_px apart if that is farther out.
// Tuned by hand on synthetic images; no test fixes the two values.
constexpr double kLeastFitRadius_px = 10;
constexpr double kLeastWidth_px = 1.5;
// A landmark is occluded if a smaller share of its arc can be used. Tuned by hand on synthetic images;
// outline_ranging_test.cpp, AMastBeforeALandmarkIsNeverQuietlyWrong, exercises it but does not fix it.
constexpr double kLeastArcSupport = 0.6;
// The bearing is not trusted if a smaller share of one side can be used. Tuned by hand on synthetic images;
// outline_ranging_test.cpp, AMastBeforeALandmarkIsNeverQuietlyWrong, exercises it but does not fix it.
constexpr double kLeastSideSupport = 0.25;
// A landmark that appears narrower than it is by more than the larger of these limits is partly hidden; one that
// appears wider by as much has its top at another height. Tuned by hand on synthetic images; outline_ranging_test.cpp,
// AMastBeforeALandmarkIsNeverQuietlyWrong and ATopThatContradictsTheMapIsInconsistentHoweverMuch, exercises them but
// does not fix them.
constexpr double kNarrow_px = 0.5;
constexpr double kNarrowSigmas = 5;
// Error of the top's position for a rim with a radius of one pixel; it falls with the square of the radius. Measured
// without noise at radii of 4 and 8 pixels; no test repeats that measurement or fixes the value.
constexpr double kCurvedError_px = 0.05;
// Error of the edges of bands that all edges of a landmark share: light that changes across a band. Measured without
// noise; banded_landmarks_test.cpp, SigmasHoldTheTruthOverSeeds, fixes it to a factor of two.
constexpr double kBandError_px = 0.025;
// Lower limits of the observed scatter over the expected one; the second is that of the sides in fine fits. The stairs
// of rays on a grid make neighbours differ in opposite directions, so the scatter along a side may be small. But light
// and background move a whole side, and scatter along it does not show that: sides are not taken as better than the
// noise model says. Tuned by hand; on rendered images of the lab, a limit of 0.25 for both leaves sigmas of the bearing
// a sixth too small. No test fixes the two values.
constexpr double kLeastScatter = 0.25;
constexpr double kLeastSideScatter = 1;
// An outline whose scatter exceeds that of all outlines by this factor counts with its own scatter. Tuned by hand on
// synthetic images; no test fixes it.
constexpr double kOddScatter = 1.5;
// The measured coverages c of pixels that are one ray each are 0 or 1, so the sum of c (1 - c) vanishes, but for
// backgrounds that change; where a pixel is the mean over its area, the sum is that of the model. Over 1000 frames of
// the lab, the median of the ratio is 0.14 for plain rendering and 0.87 for 3x3 rays; one plain view in a hundred is
// above 0.34 and one view of 3x3 rays in a hundred below 0.40. one_ray_test.cpp exercises kMostMixed but does not fix
// it.
constexpr double kMostMixed = 0.5;
// An outline in a hundred differs from the others of its view, because something hides a part of it: the evidence of
// the others counts up to ln 100. Tuned by hand on rendered images of the lab; no test fixes it.
constexpr double kOddNats = 4.6;
// Where the outlines of a view need a larger tolerance, rig or map are wrong by more than pixels can show, or pixels
// are not one ray each: then the fit to coverages is used. An outline that needs more than kMostOver times the
// tolerance of its view is hidden in part. Both tuned by hand on rendered images of the lab; no test fixes them.
constexpr double kMostTolerance_px = 0.03;
constexpr double kMostOver = 8;
constexpr double kRounding = 1.0 / 12;  // variance of rounding to whole grey levels: uniform over one level

// Sigma of the finder's top in pixels, radially and tangentially: sqrt(a^2 + (b / width)^2) for a landmark of that
// width there. Radially: whole circles (0.29 px) of whole pixels. Tangentially: 0.1 px, and another 0.1 px because a
// side in shadow loses its colour. Measured in synthetic images of 160 x 120 to 960 x 720, the part of the shadow in
// rendered images of the lab. outline_stages_test.cpp, FoundKnowsHowFarItIsOffInImagesOfAnySize, fixes the four values
// together to a chi-squared per degree of freedom of 0.4 to 1.4.
constexpr double kFoundOut_px = 0.38;
constexpr double kFoundOutThin_px2 = 0.5;
constexpr double kFoundAcross_px = 0.15;
constexpr double kFoundAcrossThin_px2 = 0.5;
// The outermost circle of the colour passes through the ends of the rim's middle third. These are behind the near
// point, or before the far one, by this share of the radius: 1 - sqrt(1 - 1/9).
constexpr double kBehindNear = 0.0572;
// An expected place is accepted if the fit's step is at most kExpectedReach_px. For a longer step the outline is fitted
// again from its new place; kExpectedRounds is the number of fits. A step above kExpectedFar_px means that the place
// was wrong. Tuned by hand on synthetic images; outline_stages_test.cpp,
// AnExpectedPlaceGivesTheSameAnswerAndAWrongOneDoesNoHarm, exercises the three values but does not fix them.
constexpr double kExpectedReach_px = 0.5;
constexpr double kExpectedFar_px = 2;
constexpr int kExpectedRounds = 2;
// Fits from an expected place stop at a step below this. Newton's steps shrink faster than tenfold, so the remaining
// error is below 1e-3 px. outline_stages_test.cpp, AnExpectedPlaceGivesTheSameAnswerAndAWrongOneDoesNoHarm, allows 0.02
// px beyond the sigma.
constexpr double kExpectedConverged_px = 1e-2;
// An expected outline is first read for edges of this width; for wider edges the fit starts as without an expected
// place. Tuned by hand on synthetic images; no test fixes it.
constexpr double kNearBlur_px = 2;

/// Returns the reach for edges of that width. The colours are read beyond the edge, whose half support is 0.7 of its
/// width across a pixel's corner (1 / sqrt(2)).
SampleReach reach_of(double blur_px) { return {.colours_px = kFineReach_px + 0.7 * blur_px, .blur_px = blur_px}; }

/// Returns the reach with which the lowest bands still show pixels of their own, at least that of sharp edges. Nearer
/// to wide edges both colours are mixed a little, one as much as the other.
SampleReach within_bands(SampleReach reach, const Outline& outline) {
  double lowest_px = INFINITY;
  for (const Outline::Strand& strand : outline.strands) {
    lowest_px = std::min(lowest_px, strand.inside.to_px - strand.inside.from_px);
  }
  constexpr double kOfBlur = 2 * 0.7;  // both ends of a band, see reach_of()
  const double blur_px = std::clamp((lowest_px - 1) / kOfBlur, 1.0, reach.blur_px);
  if (blur_px < reach.blur_px) {
    reach.blur_px = blur_px;
    reach.colours_px = reach_of(blur_px).colours_px;
  }
  return reach;
}

/// Returns the radius at which the sides begin: where they are kLeastWidth_px apart, but for a thin landmark half way
/// up.
double least_radius_px(const MirrorView& mirror, const Cylinder& c) {
  const double wedge_rad = 2 * std::asin(std::min(0.9, c.radius_m / std::max(c.range_m, 1e-9)));
  const double wide_px = std::max(kLeastFitRadius_px, kLeastWidth_px / wedge_rad);
  const Eigen::Vector2d place_m = c.place_m();
  const auto top = mirror.project({place_m.x(), place_m.y(), c.top_m});
  return top ? std::min(wide_px, (*top - mirror.settings().centre_px).norm() / 2) : wide_px;
}

/// Returns the variance of a landmark's position over that of the noise model: the value of all landmarks' outlines, or
/// its own where that is larger.
double scatter(const Scores& all, const Scores& own, double least) {
  const double common = all.expected > 0 ? std::max(all.found / all.expected, least) : 1;
  const double alone = own.expected > 0 ? own.found / own.expected : 0;
  return alone > kOddScatter * common ? alone : common;
}

/// Returns the error that the width of the outline should have.
double width_sigma_px(const OutlineFit& fit) {
  return std::hypot(fit.sigma_narrowness_px, fit.cylinder.width_doubt * rim_width_px(fit));
}

/// Returns the square of the width's error in sigmas: what moves a whole side, which the scatter along it does not
/// show. A landmark that appears far too narrow or too wide says nothing of the sides of others, and one with bands has
/// edges that no background moves.
Scores width_score(const OutlineFit& fit) {
  if (!(fit.sigma_narrowness_px > 0) || fit.cylinder.bands) return {};
  const double sigmas = std::min(std::abs(fit.narrowness_px) / width_sigma_px(fit), kNarrowSigmas);
  return {sigmas * sigmas, 1};
}

std::optional<OutlineWidth> width_of(const OutlineFit& fit, double sigma_px) {
  if (!(fit.sigma_narrowness_px > 0)) return std::nullopt;
  return OutlineWidth{fit.mean_width_px, fit.mean_width_px - fit.narrowness_px, sigma_px};
}

std::optional<Sighting> sighting_of(const OutlineFit& fit, double arc_scatter, double side_scatter) {
  // The arc determines the range, the sides the bearing.
  const Eigen::Vector3d root(std::sqrt(arc_scatter), std::sqrt(side_scatter), std::sqrt(arc_scatter));
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // of (range m, bearing rad, height m)
  covariance.topLeftCorner<2, 2>() = fit.information.inverse();
  if (fit.with_height) covariance = *fit.with_height;
  covariance = Eigen::Matrix3d(root.asDiagonal() * covariance * root.asDiagonal());
  // If the sides are farther apart, or nearer, than noise explains, something beside one of them is taken for the
  // landmark or hides it, and it is not known on which side.
  const double noise_px2 = side_scatter * fit.sigma_narrowness_px * fit.sigma_narrowness_px;
  const double doubt_px = fit.cylinder.width_doubt * rim_width_px(fit);
  const double excess_px2 = std::max(0.0, fit.narrowness_px * fit.narrowness_px - noise_px2 - doubt_px * doubt_px);
  const double bearing_px = fit.outline.near.by_bearing_pxprad.norm();
  covariance(1, 1) += excess_px2 / 4 / (bearing_px * bearing_px);
  // The model cuts pixels by straight edges and allows for the rim's mean curvature. The curvature within a pixel
  // remains as an error.
  const double half_px = rim_width_px(fit) / 2;
  const double curved_px = kCurvedError_px / (half_px * half_px);
  const double range_px = fit.outline.near.by_range_pxpm.norm();
  const double bands_px = fit.cylinder.bands ? kBandError_px : 0;
  covariance(0, 0) += (curved_px * curved_px + bands_px * bands_px) / (range_px * range_px);
  if (!covariance.allFinite() || !(covariance.topLeftCorner<2, 2>().determinant() > 0)) return std::nullopt;
  const Outline::Vertex& near = fit.outline.near;
  Eigen::Matrix<double, 2, 3> by_place;
  by_place << near.by_range_pxpm, near.by_bearing_pxprad, near.by_height_pxpm;
  Sighting sighting;
  sighting.pixel_px = near.pixel_px + by_place * Eigen::Vector3d(fit.step.x(), fit.step.y(), fit.height_step_m);
  // Where range and height are in doubt together, the pixel that shows their line is known better than either.
  const Eigen::Matrix2d of_pixel = by_place * covariance * by_place.transpose();
  // Rounding of what cancels leaves the product not quite symmetric.
  sighting.covariance_px2 = (of_pixel + of_pixel.transpose()) / 2;
  const double information = fit.arc_scores.expected / arc_scatter + fit.side_scores.expected / side_scatter;
  sighting.edge_noise_px = std::sqrt(fit.length_px / information);
  sighting.exposed_row = fit.exposed_row;
  sighting.width = width_of(fit, std::sqrt(noise_px2));
  return sighting;
}

/// Returns the sighting of pixels that are one ray each. Its edge noise is the one with which the outline would
/// determine the place as well as the posterior does.
std::optional<Sighting> sighting_of(const OutlineFit& fit, const OneRayFits& fits, std::size_t tolerance) {
  const OneRayFit& posterior = fits.by_tolerance[tolerance];
  const Outline::Vertex& near = fit.outline.near;
  Eigen::Matrix2d by_place;
  by_place << near.by_range_pxpm, near.by_bearing_pxprad;
  Sighting sighting;
  sighting.pixel_px = near.pixel_px + by_place * posterior.step;
  sighting.covariance_px2 = by_place * posterior.covariance * by_place.transpose();
  const double determinant = sighting.covariance_px2.determinant();
  if (!sighting.covariance_px2.allFinite() || !(determinant > 0)) return std::nullopt;
  sighting.edge_noise_px = std::pow(fits.motion.determinant() * posterior.covariance.determinant(), 0.25);
  sighting.exposed_row = fit.exposed_row;
  sighting.width = width_of(fit, fit.sigma_narrowness_px);
  return sighting;
}

/// The tolerances of the outlines of a view whose pixels are one ray each.
class ToleranceChoice {
 public:
  explicit ToleranceChoice(const std::vector<const OutlineSearch*>& looks) {
    for (const OutlineSearch* look : looks) {
      if (!look->one_ray) continue;
      for (std::size_t k = 0; k < all_.size(); ++k) all_[k] += std::max(relative(*look->one_ray, k), -kOddNats);
    }
    common_ = std::size_t(std::max_element(all_.begin(), all_.end()) - all_.begin());
  }

  /// Returns whether the outlines of the view fit the pixels well enough for statements of single rays.
  [[nodiscard]] bool is_close() const { return kTolerances_px[common_] <= kMostTolerance_px; }

  /// Returns the tolerance of an outline: the one of most evidence, where the other outlines' evidence counts up to
  /// kOddNats. Returns nothing where there is none, and where it exceeds that of the others by more than kMostOver.
  [[nodiscard]] std::optional<std::size_t> of(const OutlineSearch& look) const {
    if (!look.one_ray) return std::nullopt;
    Evidence others = all_;
    for (std::size_t k = 0; k < others.size(); ++k) others[k] -= std::max(relative(*look.one_ray, k), -kOddNats);
    const double most = *std::max_element(others.begin(), others.end());
    std::size_t best = 0;
    double best_evidence = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < others.size(); ++k) {
      const double evidence = relative(*look.one_ray, k) + std::max(others[k] - most, -kOddNats);
      if (evidence > best_evidence) {
        best = k;
        best_evidence = evidence;
      }
    }
    if (kTolerances_px[best] > kMostOver * kTolerances_px[common_]) return std::nullopt;
    return best;
  }

 private:
  using Evidence = std::array<double, kTolerances_px.size()>;

  /// Returns the evidence for a tolerance relative to the most likely one, <= 0.
  static double relative(const OneRayFits& fits, std::size_t k) {
    double most = fits.by_tolerance[0].log_evidence;
    for (const OneRayFit& fit : fits.by_tolerance) most = std::max(most, fit.log_evidence);
    return fits.by_tolerance[k].log_evidence - most;
  }

  Evidence all_{};
  std::size_t common_ = 0;
};

/// @param step (range m, bearing rad)
Cylinder moved(const Cylinder& cylinder, const Eigen::Vector2d& step, double height_step_m) {
  Cylinder there = cylinder;
  there.top_m += height_step_m;
  there.range_m += step.x();
  there.bearing_rad += step.y();
  return there;
}

/// Returns how far the near point moves by a fit's step. Where the height is in doubt, steps of range and height may
/// undo each other.
/// @param step (range m, bearing rad)
double step_px(const OutlineFit& fit, const Eigen::Vector2d& step) {
  const Outline::Vertex& near = fit.outline.near;
  if (fit.cylinder.height_doubt_m == 0) {
    return std::hypot(near.by_range_pxpm.norm() * step.x(), near.by_bearing_pxprad.norm() * step.y());
  }
  return (near.by_range_pxpm * step.x() + near.by_bearing_pxprad * step.y() + near.by_height_pxpm * fit.height_step_m)
      .norm();
}

}  // namespace

double rim_width_px(const OutlineFit& fit) { return fit.outline.vertices[Outline::kSideSegments].chord_px; }

// The fit of a thin landmark may stop below its top. If the landmark's colour continues beyond, the cylinder is moved
// to where the colour ends.
void ViewFitter::follow_colour(std::uint8_t label, const cv::Mat& image, OutlineFit& fit) const {
  const Outline::Vertex& middle = fit.outline.vertices[Outline::kMiddle];
  const Eigen::Vector2d out = (middle.pixel_px - fit.outline.tip_px).normalized();
  const double out_per_m = middle.by_range_pxpm.dot(out);  // < 0 where the view looks up at the top
  const Eigen::Vector2d top =
      middle.pixel_px + middle.by_range_pxpm * fit.step.x() + middle.by_bearing_pxprad * fit.step.y();
  int beyond = 0;
  for (int i = 0; i < kMostBeyond_px; ++i) {
    const Eigen::Vector2d p = top + (i + 1) * out;
    const cv::Point pixel(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
    if (!cv::Rect({0, 0}, image.size()).contains(pixel)) break;
    if (table_.label(image.ptr<std::uint8_t>(pixel.y) + std::ptrdiff_t(3) * pixel.x) != label) break;
    beyond = i + 1;
  }
  if (beyond > 0) {
    fit.cylinder.range_m = std::max(fit.cylinder.range_m + beyond / out_per_m, 1.01 * fit.cylinder.radius_m);
  }
}

Eigen::Vector2d ViewFitter::pixel_of(const Candidate& c) const {
  return mirror_.settings().centre_px +
         Eigen::Vector2d(c.top_px * std::cos(c.angle_rad), c.top_px * std::sin(c.angle_rad));
}

std::optional<Ray> ViewFitter::ray_at(const Candidate& c, double height_m) const {
  auto ray = mirror_.back_project(pixel_of(c));
  if (!ray) return std::nullopt;
  const double way = (height_m - ray->origin_m.z()) / ray->direction.z();
  if (!(way > 0)) return std::nullopt;
  ray->origin_m += way * ray->direction;
  return ray;
}

std::optional<Cylinder> ViewFitter::place(const Candidate& c, double radius_m, double top_m) const {
  const auto ray = ray_at(c, top_m);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d& at_rim = ray->origin_m;
  const double to_axis_m = ray->looks_down() ? -radius_m : radius_m;
  const double range_m = at_rim.head<2>().norm() + to_axis_m;
  if (!(range_m > radius_m)) return std::nullopt;
  return Cylinder{range_m, std::atan2(at_rim.y(), at_rim.x()), radius_m, top_m};
}

double ViewFitter::bearing_of(const Candidate& c) const {
  const Eigen::Vector2d& centre_px = mirror_.settings().centre_px;
  const auto ray = mirror_.back_project(centre_px + (pixel_of(c) - centre_px) / 2);
  return ray ? std::atan2(ray->direction.y(), ray->direction.x()) : 0.0;
}

std::optional<Sighting> ViewFitter::found(const Candidate& c, double radius_m, double top_m) const {
  const auto ray = ray_at(c, top_m);
  if (!ray) return std::nullopt;
  Eigen::Vector3d near_m = ray->origin_m;
  const double behind_near = ray->looks_down() ? 2 - kBehindNear : kBehindNear;
  near_m.head<2>() -= behind_near * radius_m * ray->direction.head<2>().normalized();
  const auto near_px = mirror_.project(near_m);
  if (!near_px) return std::nullopt;
  const Eigen::Vector2d out = (*near_px - mirror_.settings().centre_px).normalized();
  const Eigen::Vector2d across(-out.y(), out.x());
  const double width_px = 2 * c.top_px * radius_m / (near_m.head<2>().norm() + radius_m);
  const double out_px = std::hypot(kFoundOut_px, kFoundOutThin_px2 / width_px);
  const double across_px = std::hypot(kFoundAcross_px, kFoundAcrossThin_px2 / width_px);
  Sighting sighting;
  sighting.pixel_px = *near_px;
  sighting.covariance_px2 =
      out_px * out_px * out * out.transpose() + across_px * across_px * across * across.transpose();
  return sighting;
}

void ViewFitter::fit(const OutlineTask& task, const Cylinder& cylinder, const SampleReach& reach,
                     const PixelNoise& noise, const FitLimits& limits, int stride) const {
  auto& [surface, image, look, edge_samples] = task;
  const auto outline = make_outline(mirror_, cylinder, least_radius_px(mirror_, cylinder));
  if (!outline) {
    look.is_truncated = true;
    look.fit.reset();
    return;
  }
  read_edge_samples(image, table_, surface, *outline, cylinder.bands ? within_bands(reach, *outline) : reach, stride,
                    edge_samples);
  look.is_saturated = edge_samples.too_bright * 2 > static_cast<int>(edge_samples.edge_samples.size());
  look.fit = fit_outline(edge_samples, cylinder, *outline, noise, limits);
}

void ViewFitter::fit_bands(const OutlineTask& task, const Cylinder& start) const {
  OutlineSearch& look = task.look;
  Cylinder from = start;
  for (int round = 0; round < kFineRounds; ++round) {
    fit(task, from, reach_of(1), PixelNoise{}, {1, kMostBlur_px, kCoarse_px}, 1);
    if (!look.fit || step_px(*look.fit, look.fit->step) > kBandsReach_px) break;
    look.pool = look.fit->edges;
    if (step_px(*look.fit, look.fit->step) <= kFineStep_px) return;
    from = moved(from, look.fit->step, look.fit->height_step_m);
  }
  look.fit.reset();
  look.pool.reset();
}

void ViewFitter::fit_coarse(const OutlineTask& task, const Cylinder& start) const {
  if (start.bands) return fit_bands(task, start);
  OutlineSearch& look = task.look;
  // The blur of a thin landmark is limited by its width, because with more blur the landmark disappears.
  const double width_px = 2 * look.candidate->top_px * start.radius_m / start.range_m;
  const double blur_px = std::clamp(width_px / 2, 1.0, kCoarseBlur_px);
  fit(task, start, {kCoarseReach_px - kCoarseBlur_px + blur_px, blur_px}, PixelNoise{},
      {blur_px, kMostBlur_px, kCoarse_px}, kCoarseStride);
  if (!look.fit) return;
  follow_colour(task.surface.label, task.image, *look.fit);
  fit(task, Cylinder(look.fit->cylinder), reach_of(look.fit->edges.blur), PixelNoise{}, {1, kMostBlur_px, kCoarse_px},
      kCoarseStride);
  if (look.fit) look.pool = look.fit->edges;
}

bool ViewFitter::fit_near(const OutlineTask& task, const Cylinder& start) const {
  OutlineSearch tried = task.look;
  fit({task.surface, task.image, tried, task.edge_samples}, start, reach_of(kNearBlur_px), PixelNoise{},
      {1, kMostBlur_px, kCoarse_px}, kCoarseStride);
  if (!tried.fit || tried.fit->edges.blur > kNearBlur_px || step_px(*tried.fit, tried.fit->step) > kExpectedReach_px)
    return false;
  tried.pool = tried.fit->edges;
  task.look = std::move(tried);
  return true;
}

std::optional<ViewFitter::Common> ViewFitter::common(const std::vector<const OutlineSearch*>& looks) {
  double residual = 0;
  double grey = 0;
  double spread = 0;
  double mixed = 0;
  std::vector<double> code_variances;
  std::vector<double> blurs;
  for (const OutlineSearch* look : looks) {
    if (!look->pool) continue;
    residual += look->pool->residual;
    grey += look->pool->grey;
    spread += look->pool->spread;
    mixed += look->pool->mixed;
    code_variances.push_back(look->pool->code_variance);
    blurs.push_back(look->pool->blur);
  }
  if (blurs.empty()) return std::nullopt;
  Common common;
  common.noise.code_variance = std::max(base::median(std::move(code_variances)), kRounding);
  // The blur is the lens's, so it is the same for all landmarks.
  common.blur_px = base::median(std::move(blurs));
  const double code_variance = common.noise.code_variance;
  const bool is_noisy = code_variance > kNoisyVariance && code_variance * grey > kNoisyShare * residual;
  common.reach = reach_of(common.blur_px);
  common.reach.measured_blur_px = common.blur_px;
  if (is_noisy) common.reach.samples = kManySamples;
  const double explained = kSureOfSampling * code_variance * grey;
  if (spread > 0) common.noise.sampling = std::clamp((residual - explained) / spread, 1e-6, 1.0);
  common.is_one_ray = mixed < kMostMixed * spread;
  return common;
}

std::optional<Eigen::Vector2d> ViewFitter::fit_whole(const OutlineTask& task, const Cylinder& start,
                                                     const Common& common, double converged_px) const {
  OutlineSearch& look = task.look;
  look.is_fine = true;
  // The posteriors of single rays know no height.
  look.is_one_ray = common.is_one_ray && start.height_doubt_m == 0;
  fit(task, start, common.reach, common.noise, {common.blur_px, common.blur_px, converged_px}, 1);
  if (!look.fit) return std::nullopt;
  look.one_ray = look.is_one_ray ? fit_one_ray(task.edge_samples, *look.fit) : std::nullopt;
  return look.one_ray ? look.one_ray->by_tolerance.front().step : look.fit->step;
}

void ViewFitter::fit_fine(const OutlineTask& task, const Common& common) const {
  Cylinder start = task.look.fit->cylinder;
  for (int round = 0; round < kFineRounds; ++round) {
    const auto step = fit_whole(task, start, common, kConverged_px);
    if (!step || step_px(*task.look.fit, *step) <= kFineStep_px) return;
    start = moved(start, *step, task.look.fit->height_step_m);
  }
}

bool ViewFitter::fit_expected(const OutlineTask& task, const Cylinder& expected, const Common& common) const {
  OutlineSearch tried = task.look;
  Cylinder start = expected;
  for (int round = 0; round < kExpectedRounds; ++round) {
    const auto step =
        fit_whole({task.surface, task.image, tried, task.edge_samples}, start, common, kExpectedConverged_px);
    if (!step) return false;
    const double length_px = step_px(*tried.fit, *step);
    if (length_px <= kExpectedReach_px) {
      task.look = std::move(tried);
      return true;
    }
    if (length_px > kExpectedFar_px) return false;
    start = moved(start, *step, tried.fit->height_step_m);
  }
  return false;
}

std::vector<OutlineVerdict> ViewFitter::judge(const std::vector<const OutlineSearch*>& looks) {
  // Coarse fits and fine fits are pooled separately.
  std::array<Scores, 2> arc;
  std::array<Scores, 2> sides;
  std::array<Scores, 2> widths;
  const auto add = [](Scores& sum, const Scores& one) {
    sum.found += one.found;
    sum.expected += one.expected;
  };
  for (const OutlineSearch* look : looks) {
    if (!look->fit) continue;
    const std::size_t stage = look->is_fine ? 1 : 0;
    add(arc[stage], look->fit->arc_scores);
    add(sides[stage], look->fit->side_scores);
    add(widths[stage], width_score(*look->fit));
  }
  std::vector<OutlineVerdict> judged(looks.size());
  const ToleranceChoice choice(looks);
  for (std::size_t i = 0; i < looks.size(); ++i) {
    if (!looks[i]->fit) continue;
    const OutlineFit& fit = *looks[i]->fit;
    const std::size_t stage = looks[i]->is_fine ? 1 : 0;
    judged[i].is_occluded = fit.arc_support < kLeastArcSupport;
    const double off_px = std::max(kNarrow_px, kNarrowSigmas * width_sigma_px(fit));
    const bool is_side_hidden = std::min(fit.left_support, fit.right_support) < kLeastSideSupport;
    judged[i].is_narrow = is_side_hidden || fit.narrowness_px > off_px;
    judged[i].is_wide = fit.narrowness_px < -off_px;
    if (judged[i].is_occluded) continue;
    if (looks[i]->is_one_ray && choice.is_close()) {
      if (const auto tolerance = choice.of(*looks[i])) {
        // All pixels agree with the width of the map. The stairs mislead the fit to coverages.
        judged[i].is_narrow = is_side_hidden;
        judged[i].is_wide = false;
        judged[i].sighting = sighting_of(fit, *looks[i]->one_ray, *tolerance);
      }
      judged[i].is_occluded = !judged[i].sighting && !judged[i].is_wide;
      continue;
    }
    const double along_sides =
        scatter(sides[stage], fit.side_scores, looks[i]->is_fine ? kLeastSideScatter : kLeastScatter);
    const double of_widths = widths[stage].found / std::max(widths[stage].expected, 1.0);
    judged[i].sighting =
        sighting_of(fit, scatter(arc[stage], fit.arc_scores, kLeastScatter), std::max(along_sides, of_widths));
  }
  return judged;
}
}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#include "vision/self_rig/camera_sight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "base/quantile.h"
#include "vision/bands/band_finder.h"
#include "vision/method_arguments.h"
#include "vision/outline/finder.h"

namespace twocone::vision {
namespace {

constexpr std::size_t kRegions = 2;  // of one colour: another object of that colour may be larger than the landmark
constexpr double kSameFit = 0.9;     // share of the landmarks that the best pose explains
constexpr double kBelievedRadiusShare = CalibrationPriors{}.rim_share;

// A lens half a millimetre off its mirror's axis moves the rim against the tip by a pixel (f e (1/d - 1/(d + R))).
// Without a tip nothing shows it.
constexpr double kUncheckedCentreSigma_px = 1;

/// Returns the offset of a candidate from the middle of the undistorted image.
/// @param about_px the place in the camera's image from which the candidate is measured
std::optional<Eigen::Vector2d> undistorted(const MirrorView& lens, const Eigen::Vector2d& about_px,
                                           const Eigen::Vector2d& middle_px, const Candidate& candidate) {
  const Complex out = std::polar(candidate.top_px, candidate.angle_rad);
  const auto place = lens.undistort_px(about_px + Eigen::Vector2d(out.real(), out.imag()));
  return place ? std::optional<Eigen::Vector2d>(*place - middle_px) : std::nullopt;
}

class CameraSearch {
 public:
  CameraSearch(const SelfRigProblem& problem, Side camera)
      : problem_(problem), camera_(camera), table_(colours_of(problem.landmarks)) {
    for (std::size_t k = 0; k < problem.landmarks.size(); ++k) {
      if (!problem.landmarks[k].bands) coloured_.push_back(k);
    }
  }

  [[nodiscard]] CameraSight go() const {
    CameraSight sight = with_circle_of_images();
    if (!sight.view.circle) return sight;
    fit_all(sight);
    if (sight.least_slope_error() > kElevationSigma_rad) choose_by_slopes(sight);
    choose_by_ranges(sight);
    return sight;
  }

 private:
  [[nodiscard]] std::vector<cv::Mat> images() const {
    std::vector<cv::Mat> images;
    for (const SelfRigFrame& frame : problem_.frames) {
      const cv::Mat& image = of_view(frame, camera_);
      if (!image.empty()) images.push_back(image);
    }
    return images;
  }

  [[nodiscard]] Sightings sighted(const RimCircle& circle) const {
    Sightings all;
    const MirrorView& lens = of_view(problem_.rig, camera_);
    const MirrorView banded_view = with_circle(lens, circle);
    std::optional<BandFinder> finder;  // the images of a camera have one size
    for (const SelfRigFrame& frame : problem_.frames) {
      const cv::Mat& image = of_view(frame, camera_);
      all.emplace_back();
      if (image.empty()) continue;
      all.back() = sight_by_colour(image, circle, lens, table_, coloured_.size());
      for (ColourSighting& sighting : all.back()) sighting.landmark = coloured_[sighting.landmark];
      if (coloured_.size() == problem_.landmarks.size()) continue;
      if (!finder) finder.emplace(banded_view, image.size());
      add_bands(image, banded_view, *finder, all.back());
    }
    return all;
  }

  /// Returns the view of a circle, for bands; a view's tilt and places do not matter to their reading.
  [[nodiscard]] static MirrorView with_circle(const MirrorView& lens, const RimCircle& circle) {
    MirrorViewSettings settings = lens.settings();
    settings.centre_px = lens.undistort_px(circle.centre_px).value_or(circle.centre_px);
    settings.rim_radius_px = circle.radius_px;
    return MirrorView(settings);
  }

  /// Adds the landmarks whose bands an image shows.
  void add_bands(const cv::Mat& image, const MirrorView& view, const BandFinder& finder,
                 std::vector<ColourSighting>& sightings) const {
    const Eigen::Vector2d& middle_px = view.settings().centre_px;
    for (const BandCandidate& bands : finder.find(image)) {
      const auto is_read = [&](const Landmark& l) { return l.bands && l.bands->number == bands.number; };
      const auto landmark = std::ranges::find_if(problem_.landmarks, is_read);
      if (landmark == problem_.landmarks.end()) continue;
      const auto from = undistorted(view, middle_px, middle_px, bands.candidate);
      if (!from) continue;
      sightings.push_back({std::size_t(landmark - problem_.landmarks.begin()), std::atan2(from->y(), from->x()),
                           from->norm(), bands.candidate.area_px, false});
    }
  }

  /// Takes a circle: centre with the tip's help.
  static void take_circle(const RimMeasurement& rim, SelfView& v) {
    v.circle = rim;
    v.centre_px = rim.centre_px;
    v.sigma_centre_px = std::max(kUncheckedCentreSigma_px, rim.sigma_centre_px);
    if (!v.mirror.tip) return;
    // Rim and tip are apart by more than their sigmas where the lens is off the mirror's axis. Their difference shows
    // by how much, and neither is nearer to the truth of the model, which has one centre.
    const Eigen::Vector2d apart_px = v.mirror.tip->centre_px - rim.centre_px;
    const auto square = [](double x) { return x * x; };
    const double own = square(rim.sigma_centre_px) + square(v.mirror.tip->sigma_px);
    // Noise alone exceeds this quantile, of chi-squared with two degrees of freedom, once in 100.
    constexpr double kApart = 9.21;
    const bool is_off_axis = apart_px.squaredNorm() > kApart * own;
    const double common = is_off_axis ? std::max(0.0, apart_px.squaredNorm() / 2 - own) : 0;
    const double rim_weight = 1 / (square(rim.sigma_centre_px) + common);
    const double tip_weight = 1 / (square(v.mirror.tip->sigma_px) + common);
    v.centre_px += tip_weight / (rim_weight + tip_weight) * apart_px;
    v.sigma_centre_px = std::max(
        {kLeastCentreSigma_px, is_off_axis ? apart_px.norm() / 2 : 0.0, 1 / std::sqrt(rim_weight + tip_weight)});
  }

  [[nodiscard]] CameraSight with_circle_of_images() const {
    CameraSight sight;
    sight.camera = camera_;
    sight.sightings.resize(problem_.frames.size());
    SelfView& v = sight.view;
    const auto all = images();
    if (all.empty()) {
      v.mirror.verdict = MirrorVerdict::kDark;
      return sight;
    }
    v.mirror = find_mirror(all);
    if (v.mirror.rim) {
      take_circle(*v.mirror.rim, v);
    } else if (problem_.has_believed_circles && v.mirror.verdict != MirrorVerdict::kDark &&
               v.mirror.verdict != MirrorVerdict::kEven) {
      // The rim may have no contrast to its background.
      const MirrorViewSettings& believed = of_view(problem_.rig, camera_).settings();
      const Eigen::Vector2d centre_px =
          of_view(problem_.rig, camera_).distort_px(believed.centre_px).value_or(believed.centre_px);
      constexpr double kBelievedCentre_px = CalibrationPriors{}.centre_px;
      v.is_circle_believed = true;
      take_circle(
          {centre_px, believed.rim_radius_px, kBelievedCentre_px, kBelievedRadiusShare * believed.rim_radius_px, 0, 0},
          v);
    }
    if (!v.circle) return sight;
    sight.sightings = sighted({v.centre_px, v.circle->radius_px, 0});
    std::vector<bool> seen(problem_.landmarks.size());
    for (const auto& frame : sight.sightings) {
      for (const ColourSighting& s : frame) seen[s.landmark] = true;
    }
    v.landmarks = std::size_t(std::ranges::count(seen, true));
    return sight;
  }

  /// Tops that the rim cuts count as well: within a circle that is too small, it cuts all of them.
  [[nodiscard]] double mean_slope_error(const MirrorView& view, const std::vector<ColourSighting>& sightings,
                                        const ImagePose& pose) const {
    double errors = 0;
    int count = 0;
    for (const std::size_t i : pose.fitted) {
      const Landmark& landmark = problem_.landmarks[sightings[i].landmark];
      const auto error = slope_error(view, sightings[i], landmark, std::abs(place_of(landmark) - pose.place_m));
      if (!error) continue;
      errors += *error;
      ++count;
    }
    return count > 0 ? errors / count : 0;
  }

  [[nodiscard]] CameraFit fit(const CameraSight& sight, const Guess& guess) const {
    CameraFit result;
    std::vector<double> logs;
    std::vector<double> sigmas;
    std::vector<double> slope_errors;
    const MirrorView view = upright_view(problem_.rig, guess.mirror, sight.view.circle->radius_px);
    for (const auto& frame : sight.sightings) {
      const auto read = ranged(frame, view, guess.mirrored, problem_.landmarks);
      auto& pose = result.poses.emplace_back(pose_of(read, problem_.landmarks));
      if (!pose) continue;
      result.fitted += pose->fitted.size();
      slope_errors.push_back(mean_slope_error(view, frame, *pose));
      if (!std::isfinite(pose->sigma_log_scale)) continue;
      logs.push_back(pose->mean_log_scale);
      sigmas.push_back(pose->sigma_log_scale);
    }
    if (!slope_errors.empty()) result.slope_error = base::median(std::move(slope_errors));
    if (logs.empty()) return result;
    // The frames of a drive share their errors in part: their scatter is taken as that of the mean of three.
    constexpr double kShared = 3;
    const double median = base::median(logs);
    const double scatter = scatter_about(median, logs);
    result.range_scale = std::exp(-median);
    const double of_one = std::max(scatter, logs.size() < 3 ? kLogRangeSigma : 0.0);
    result.sigma_range_scale =
        result.range_scale * std::max({kFoundRadiusShare, base::median(std::move(sigmas)),
                                       of_one / std::sqrt(std::min(kShared, double(logs.size())))});
    return result;
  }

  void fit_all(CameraSight& sight) const {
    for (const bool mirrored : {false, true}) {
      for (const Side mirror : {Side::kLower, Side::kUpper}) {
        sight.fits[mirrored][std::size_t(mirror)] = fit(sight, {mirrored, mirror});
      }
    }
  }

  [[nodiscard]] CameraSight with_rim(const RimMeasurement& rim, CameraSight sight) const {
    sight.view.mirror.rim = rim;
    take_circle(rim, sight.view);
    sight.sightings = sighted({sight.view.centre_px, rim.radius_px, 0});
    fit_all(sight);
    return sight;
  }

  /// Takes the concentric circle with which the tops are as high over the horizon as on the map. With cones of more
  /// than 90 degrees, the wrong radius turns what is above the horizon into what is below it.
  void choose_by_slopes(CameraSight& sight) const {
    const std::vector<RimMeasurement> others = sight.view.mirror.others;
    for (const RimMeasurement& other : others) {
      CameraSight tried = with_rim(other, sight);
      if (tried.least_slope_error() < sight.least_slope_error()) sight = std::move(tried);
    }
  }

  /// Takes the concentric circle, or the radius of a believed one, that the landmarks' ranges need.
  void choose_by_ranges(CameraSight& sight) const {
    SelfView& v = sight.view;
    const CameraFit& best = sight.best_fit();
    if (best.range_scale <= 0 || best.sigma_range_scale > kBelievedRadiusShare * best.range_scale) return;
    const double wanted_px = v.circle->radius_px * best.range_scale;
    const double sigma = best.sigma_range_scale / best.range_scale;
    if (!v.mirror.others.empty()) {
      RimMeasurement nearest = *v.mirror.rim;
      for (const RimMeasurement& other : v.mirror.others) {
        const auto off = [&](const RimMeasurement& rim) { return std::abs(std::log(rim.radius_px / wanted_px)); };
        // The innermost stands unless the ranges contradict it.
        if (off(nearest) > 2 * sigma && off(other) < off(nearest)) nearest = other;
      }
      if (nearest.radius_px != v.circle->radius_px) sight = with_rim(nearest, std::move(sight));
    } else if (v.is_circle_believed) {
      v.circle->radius_px = wanted_px;
      v.circle->sigma_radius_px = sigma * wanted_px;
      sight.sightings = sighted({v.centre_px, wanted_px, 0});
      fit_all(sight);
    }
  }

  const SelfRigProblem& problem_;
  Side camera_;
  std::vector<std::size_t> coloured_;  ///< the landmarks of table_'s colours
  ColourTable table_;
};

}  // namespace

double scatter_about(double median, std::vector<double> values) {
  for (double& value : values) value = std::abs(value - median);
  return base::robust_sigma(std::move(values));
}

const CameraFit& CameraSight::best_fit() const {
  const Side other = camera == Side::kLower ? Side::kUpper : Side::kLower;
  const CameraFit* best = &fit_of({false, camera});
  for (const Guess guess : {Guess{true, camera}, Guess{false, other}, Guess{true, other}}) {
    if (fit_of(guess).fitted > best->fitted) best = &fit_of(guess);
  }
  return *best;
}

double CameraSight::least_slope_error() const {
  const std::size_t most = best_fit().fitted;
  double least = std::numeric_limits<double>::infinity();
  if (most == 0) return least;
  for (const auto& by_mirror : fits) {
    for (const CameraFit& fit : by_mirror) {
      if (double(fit.fitted) >= kSameFit * double(most)) least = std::min(least, std::abs(fit.slope_error));
    }
  }
  return least;
}

CameraSight sight_camera(const SelfRigProblem& problem, Side camera) { return CameraSearch(problem, camera).go(); }

std::vector<ColourSighting> sight_by_colour(const cv::Mat& rgb, const RimCircle& circle, const MirrorView& lens,
                                            const ColourTable& colours, std::size_t landmarks) {
  if (rgb.type() != CV_8UC3) throw std::invalid_argument("sight_by_colour: the image must be of type CV_8UC3 (r g b)");
  const MirrorView plain({.cone = {.rim_radius_m = 1, .lens_to_tip_m = 1},
                          .centre_px = circle.centre_px,
                          .rim_radius_px = circle.radius_px});
  const Eigen::Vector2d middle = lens.undistort_px(circle.centre_px).value_or(circle.centre_px);
  const std::vector<Found> found = Finder(plain, rgb.size()).find(rgb, colours, std::vector<bool>(landmarks, true));
  std::vector<ColourSighting> sightings;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const auto& regions = found[k].candidates;
    for (std::size_t i = 0; i < std::min(kRegions, regions.size()); ++i) {
      const auto from = undistorted(lens, circle.centre_px, middle, regions[i]);
      if (!from) continue;
      sightings.push_back({k, std::atan2(from->y(), from->x()), from->norm(), regions[i].area_px, regions[i].at_rim});
    }
  }
  return sightings;
}

}  // namespace twocone::vision

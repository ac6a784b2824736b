// SPDX-License-Identifier: Apache-2.0
#include "vision/self_rig.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "base/quantile.h"
#include "vision/bands/band_finder.h"
#include "vision/method_arguments.h"
#include "vision/outline/finder.h"
#include "vision/self_rig/image_pose.h"

namespace twocone::vision {
namespace {

constexpr std::size_t kRegions = 2;  // of one colour: another object of that colour may be larger than the landmark
// By chance a further landmark agrees with a wrong pose with a probability of 2 kBearingLimit_rad / 2 pi: 0.06. Two
// more landmarks in agreement than the other answer explains happen by chance once in 250.
constexpr double kLeastSurplus = 2;
constexpr double kSurplusSigmas = 1.5;  // of one landmark, for the report: 0.06 is 1.5 sigmas
constexpr double kDecided = 3;          // sigmas
// A radius of the rim that is found is good to a per cent, also where d / R is off by a ruler's millimetre.
constexpr double kFoundRadiusShare = 0.02;
constexpr double kBelievedRadiusShare = CalibrationPriors{}.rim_share;
// Of the mean slope that a mirror shows, by its radius, its cone and its tilt.
constexpr double kSlopeSigma = 0.015;
// Both cameras show one mirror if the disparity is nearer to that of one mirror than this share of what the map needs.
constexpr double kSameMirror = 0.3;
// Position of one view's pose, and relative error of a turn by the wheels (5 % of separation or radius).
constexpr double kPositionSigma_m = 0.05;
constexpr double kTurnShare = 0.05;
constexpr double kLeastTurn_rad = 0.03;
constexpr double kMostAzimuthSigma_rad = 0.15;

// A lens half a millimetre off its mirror's axis moves the rim against the tip by a pixel (f e (1/d - 1/(d + R))).
// Without a tip nothing shows it.
constexpr double kUncheckedCentreSigma_px = 1;

using Sightings = std::vector<std::vector<ColourSighting>>;  // frame by frame
using Poses = std::vector<std::optional<ImagePose>>;

/// Returns the standard deviation of values about their median, by base::robust_sigma().
double scatter_about(double median, std::vector<double> values) {
  for (double& value : values) value = std::abs(value - median);
  return base::robust_sigma(std::move(values));
}

/// The fit of all frames of one camera.
struct CameraFit {
  Poses poses;
  std::size_t fitted = 0;
  double range_scale = 0;  ///< as SelfView
  double sigma_range_scale = 0;
};

/// Returns the offset of a candidate from the middle of the undistorted image.
/// @param about_px the place in the camera's image from which the candidate is measured
std::optional<Eigen::Vector2d> undistorted(const MirrorView& lens, const Eigen::Vector2d& about_px,
                                           const Eigen::Vector2d& middle_px, const Candidate& candidate) {
  const Complex out = std::polar(candidate.top_px, candidate.angle_rad);
  const auto place = lens.undistort_px(about_px + Eigen::Vector2d(out.real(), out.imag()));
  return place ? std::optional<Eigen::Vector2d>(*place - middle_px) : std::nullopt;
}

/// Work on one problem.
class RigSearch {
 public:
  explicit RigSearch(const SelfRigProblem& problem) : problem_(problem), table_(colours_of(problem.landmarks)) {
    for (std::size_t k = 0; k < problem.landmarks.size(); ++k) {
      if (!problem.landmarks[k].bands) coloured_.push_back(k);
    }
  }

  SelfRig go() {
    for (const Side camera : {Side::kLower, Side::kUpper}) find_circle(camera);
    for (const Side camera : {Side::kLower, Side::kUpper}) fit_circle(camera);
    decide_exchanged();
    for (const Side camera : {Side::kLower, Side::kUpper}) decide_mirrored(camera);
    find_relative_azimuth();
    find_azimuth();
    return std::move(found_);
  }

 private:
  SelfView& view(Side camera) { return found_.views[std::size_t(camera)]; }
  Sightings& sightings(Side camera) { return sightings_[std::size_t(camera)]; }
  static Side other(Side side) { return side == Side::kLower ? Side::kUpper : Side::kLower; }

  [[nodiscard]] std::vector<cv::Mat> images(Side camera) const {
    std::vector<cv::Mat> images;
    for (const SelfRigFrame& frame : problem_.frames) {
      const cv::Mat& image = of_view(frame, camera);
      if (!image.empty()) images.push_back(image);
    }
    return images;
  }

  [[nodiscard]] Sightings sighted(Side camera, const RimCircle& circle) const {
    Sightings all;
    const MirrorView& lens = of_view(problem_.rig, camera);
    const MirrorView banded_view = with_circle(lens, circle);
    std::optional<BandFinder> finder;  // the images of a camera have one size
    for (const SelfRigFrame& frame : problem_.frames) {
      const cv::Mat& image = of_view(frame, camera);
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
  void take_circle(Side camera, const RimMeasurement& rim) {
    SelfView& v = view(camera);
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

  void find_circle(Side camera) {
    SelfView& v = view(camera);
    const auto all = images(camera);
    if (all.empty()) {
      v.mirror.verdict = MirrorVerdict::kDark;
      return;
    }
    v.mirror = find_mirror(all);
    if (v.mirror.rim) {
      take_circle(camera, *v.mirror.rim);
    } else if (problem_.has_believed_circles && v.mirror.verdict != MirrorVerdict::kDark &&
               v.mirror.verdict != MirrorVerdict::kEven) {
      // The rim may have no contrast to its background.
      const MirrorViewSettings& believed = of_view(problem_.rig, camera).settings();
      const Eigen::Vector2d centre_px =
          of_view(problem_.rig, camera).distort_px(believed.centre_px).value_or(believed.centre_px);
      constexpr double kBelievedCentre_px = CalibrationPriors{}.centre_px;
      v.is_circle_believed = true;
      take_circle(camera, {centre_px, believed.rim_radius_px, kBelievedCentre_px,
                           kBelievedRadiusShare * believed.rim_radius_px, 0, 0});
    }
    if (!v.circle) {
      sightings(camera).resize(problem_.frames.size());
      return;
    }
    sightings(camera) = sighted(camera, {v.centre_px, v.circle->radius_px, 0});
    std::vector<bool> seen(problem_.landmarks.size());
    for (const auto& frame : sightings(camera)) {
      for (const ColourSighting& s : frame) seen[s.landmark] = true;
    }
    v.landmarks = std::size_t(std::ranges::count(seen, true));
  }

  CameraFit fit(Side camera, const Guess& guess) {
    CameraFit result;
    std::vector<double> logs;
    for (const auto& frame : sightings(camera)) {
      const auto read = ranged(frame, guess, problem_.rig, view(camera).circle->radius_px, problem_.landmarks);
      auto& pose = result.poses.emplace_back(pose_of(read, problem_.landmarks));
      if (!pose) continue;
      result.fitted += pose->fitted.size();
      logs.push_back(pose->mean_log_scale);
    }
    if (logs.empty()) return result;
    // The frames of a drive share their errors in part: their scatter is taken as that of the mean of three.
    constexpr double kShared = 3;
    const double median = base::median(logs);
    const double scatter = scatter_about(median, logs);
    result.range_scale = std::exp(-median);
    result.sigma_range_scale =
        result.range_scale * std::max(kFoundRadiusShare, std::max(scatter, logs.size() < 3 ? kLogRangeSigma : 0.0) /
                                                             std::sqrt(std::min(kShared, double(logs.size()))));
    return result;
  }

  /// Fits the map with all four guesses, and chooses among concentric circles and believed radii.
  void fit_circle(Side camera) {
    SelfView& v = view(camera);
    if (!v.circle) return;
    fit_all(camera);
    if (best_fit(camera).range_scale <= 0) fit_other_circles(camera);
    const CameraFit& best = best_fit(camera);
    if (best.range_scale <= 0) return;
    if (!v.mirror.others.empty()) {
      const double wanted_px = v.circle->radius_px * best.range_scale;
      RimMeasurement nearest = *v.mirror.rim;
      for (const RimMeasurement& other : v.mirror.others) {
        const auto off = [&](const RimMeasurement& rim) { return std::abs(std::log(rim.radius_px / wanted_px)); };
        // The innermost stands unless the ranges contradict it.
        const double sigma = best.sigma_range_scale / best.range_scale;
        if (off(nearest) > 2 * sigma && off(other) < off(nearest)) nearest = other;
      }
      if (nearest.radius_px != v.circle->radius_px) fit_to(camera, nearest);
    } else if (v.is_circle_believed) {
      v.circle->radius_px *= best.range_scale;
      v.circle->sigma_radius_px = best.sigma_range_scale / best.range_scale * v.circle->radius_px;
      sightings(camera) = sighted(camera, {v.centre_px, v.circle->radius_px, 0});
      fit_all(camera);
    }
  }

  void fit_to(Side camera, const RimMeasurement& rim) {
    SelfView& v = view(camera);
    v.mirror.rim = rim;
    take_circle(camera, rim);
    sightings(camera) = sighted(camera, {v.centre_px, v.circle->radius_px, 0});
    fit_all(camera);
  }

  /// Takes the first of the other concentric circles with which landmarks stand as on the map. With cones of more than
  /// 90 degrees, the wrong radius may turn what is above the horizon into what is below it, so that nothing fits.
  void fit_other_circles(Side camera) {
    const SelfView view_before = view(camera);
    const Sightings sightings_before = sightings(camera);
    const auto fits_before = fits_[std::size_t(camera)];
    for (const RimMeasurement& other : view_before.mirror.others) {
      fit_to(camera, other);
      if (best_fit(camera).range_scale > 0) return;
    }
    view(camera) = view_before;
    sightings(camera) = sightings_before;
    fits_[std::size_t(camera)] = fits_before;
  }

  void fit_all(Side camera) {
    for (const bool mirrored : {false, true}) {
      for (const Side mirror : {Side::kLower, Side::kUpper}) {
        fits_[std::size_t(camera)][mirrored][std::size_t(mirror)] = fit(camera, {mirrored, mirror});
      }
    }
  }
  [[nodiscard]] const CameraFit& fit_of(Side camera, const Guess& guess) const {
    return fits_[std::size_t(camera)][guess.mirrored][std::size_t(guess.mirror)];
  }
  [[nodiscard]] const CameraFit& best_fit(Side camera) const {
    const CameraFit* best = &fit_of(camera, {false, camera});
    for (const Guess guess : {Guess{true, camera}, Guess{false, other(camera)}, Guess{true, other(camera)}}) {
      if (fit_of(camera, guess).fitted > best->fitted) best = &fit_of(camera, guess);
    }
    return *best;
  }

  /// Returns why one camera has nothing to say, or kNothing.
  NotFound reason_of(Side camera) {
    if (view(camera).is_blind()) return NotFound::kNoMirror;
    return view(camera).landmarks < kLeastRigLandmarks ? NotFound::kNoLandmarks : NotFound::kNothing;
  }
  NotFound reason_of_both() {
    const NotFound lower = reason_of(Side::kLower);
    return lower != NotFound::kNothing ? lower : reason_of(Side::kUpper);
  }

  double focal_px(Side camera, Side mirror) {
    return focal_length_px(of_view(problem_.rig, mirror).settings().cone, view(camera).circle->radius_px);
  }
  [[nodiscard]] double tip_m(Side mirror) const { return of_view(problem_.rig, mirror).tip_m().z(); }

  void decide_exchanged() {
    Decision& exchanged = found_.exchanged;
    exchanged.reason = reason_of_both();
    if (exchanged.reason != NotFound::kNothing) return;
    std::vector<double> logs;
    double expected = 0;
    for_each_pair([&](const ColourSighting& lower, const ColourSighting& upper) {
      const double top_m = problem_.landmarks[lower.landmark].top_m;
      if (top_m <= std::max(tip_m(Side::kLower), tip_m(Side::kUpper))) return;
      logs.push_back(std::log(lower.top_px / focal_px(Side::kLower, Side::kLower)) -
                     std::log(upper.top_px / focal_px(Side::kUpper, Side::kUpper)));
      expected += std::log((top_m - tip_m(Side::kLower)) / (top_m - tip_m(Side::kUpper)));
    });
    exchanged.reason = NotFound::kUndecided;
    if (logs.empty()) {
      decide_exchanged_by_slopes();
      return;
    }
    expected /= double(logs.size());
    const double median = base::median(logs);
    const auto radius_share = [&](Side camera) {
      return view(camera).is_circle_believed && view(camera).range_scale <= 0 ? kBelievedRadiusShare
                                                                              : kFoundRadiusShare;
    };
    const double scatter = std::max(scatter_about(median, logs), 0.02);
    const double sigma = std::hypot(scatter / std::sqrt(double(logs.size())),
                                    std::hypot(radius_share(Side::kLower), radius_share(Side::kUpper)));
    // In the middle between the two answers is what two cameras of one mirror show.
    exchanged.sigmas = std::abs(median) / sigma;
    if (std::abs(median) < kSameMirror * expected) {
      found_.shows_one_mirror = sigma < kSameMirror * expected / 2;
      return;
    }
    if (exchanged.sigmas < kDecided) return;
    exchanged.value = median < 0;
    exchanged.reason = NotFound::kNothing;
  }
  /// Of landmarks that are lower than a mirror, as those of mirrors that see the floor are: whatever its height, the
  /// lower mirror shows a top at a greater slope than the upper one, by their separation over its distance.
  void decide_exchanged_by_slopes() {
    Decision& exchanged = found_.exchanged;
    const MirrorView lower = upright_view(Side::kLower);
    const MirrorView upper = upright_view(Side::kUpper);
    std::vector<double> differences;
    for_each_pair([&](const ColourSighting& in_lower, const ColourSighting& in_upper) {
      differences.push_back(std::tan(lower.elevation_rad(in_lower.top_px)) -
                            std::tan(upper.elevation_rad(in_upper.top_px)));
    });
    if (differences.empty()) return;
    double farthest_m = 0;
    for (const Landmark& one : problem_.landmarks) {
      for (const Landmark& two : problem_.landmarks) {
        farthest_m = std::max(farthest_m, (place_m(one) - place_m(two)).norm());
      }
    }
    const double median = base::median(differences);
    const double scatter = scatter_about(median, differences);
    const double sigma = std::hypot(scatter / std::sqrt(double(differences.size())), kSlopeSigma);
    exchanged.sigmas = std::abs(median) / sigma;
    if (exchanged.sigmas < kDecided) {
      const double least = (tip_m(Side::kUpper) - tip_m(Side::kLower)) / farthest_m;
      found_.shows_one_mirror = std::abs(median) < kSameMirror * least && sigma < kSameMirror * least / 2;
      return;
    }
    exchanged.value = median < 0;
    exchanged.reason = NotFound::kNothing;
  }
  /// Returns the view of a camera by the mirror that it should show, for elevations.
  MirrorView upright_view(Side camera) {
    return MirrorView(
        {.cone = of_view(problem_.rig, camera).settings().cone, .rim_radius_px = view(camera).circle->radius_px});
  }
  /// Calls `use` with the sightings, in the lower and the upper camera, of each landmark that both see in a frame,
  /// inside their rims.
  template <typename Use>
  void for_each_pair(const Use& use) {
    for (std::size_t f = 0; f < problem_.frames.size(); ++f) {
      const std::vector<ColourSighting>& in_lower = sightings(Side::kLower)[f];
      const std::vector<ColourSighting>& in_upper = sightings(Side::kUpper)[f];
      for (const ColourSighting& a : in_lower) {
        for (const ColourSighting& b : in_upper) {
          if (a.landmark != b.landmark || a.at_rim || b.at_rim) continue;
          if (is_first(in_lower, a) && is_first(in_upper, b)) use(a, b);
        }
      }
    }
  }
  static bool is_first(const std::vector<ColourSighting>& frame, const ColourSighting& sighting) {
    const auto first = std::ranges::find(frame, sighting.landmark, &ColourSighting::landmark);
    return &*first == &sighting;
  }

  [[nodiscard]] Side mirror_of(Side camera) const {
    return found_.exchanged.value.value_or(false) ? other(camera) : camera;
  }

  void decide_mirrored(Side camera) {
    SelfView& v = view(camera);
    v.mirrored.reason = reason_of(camera);
    if (v.mirrored.reason != NotFound::kNothing) return;
    const Side mirror = mirror_of(camera);
    const CameraFit& straight = fit_of(camera, {false, mirror});
    const CameraFit& mirrored = fit_of(camera, {true, mirror});
    const double surplus = double(mirrored.fitted) - double(straight.fitted);
    const double by_map = std::abs(surplus) >= kLeastSurplus ? surplus * kSurplusSigmas : 0;
    const double by_motion = motion_sigmas(camera);
    v.mirrored.reason = NotFound::kUndecided;
    const bool is_by_motion = std::abs(by_motion) >= kDecided;
    if (by_map == 0 && !is_by_motion) {
      if (straight.fitted + mirrored.fitted == 0) v.mirrored.reason = NotFound::kNotTheMap;
      return;
    }
    if (by_map != 0 && is_by_motion && (by_map > 0) != (by_motion > 0)) return;  // they contradict each other
    v.mirrored.value = (by_map != 0 ? by_map : by_motion) > 0;
    v.mirrored.sigmas = std::max(std::abs(by_map), std::abs(by_motion));
    v.mirrored.reason = NotFound::kNothing;
    const CameraFit& chosen = fit_of(camera, {*v.mirrored.value, mirror});
    v.fitted = chosen.fitted;
    v.range_scale = chosen.range_scale;
    v.sigma_range_scale = chosen.sigma_range_scale;
    if (chosen.fitted == 0) v.mirrored = {{}, 0, NotFound::kNotTheMap};
  }

  /// Returns the sigmas by which the turns of the body speak for a mirrored image; negative: against it.
  double motion_sigmas(Side camera) {
    std::vector<std::pair<double, double>> turns;  // of the body, of the image
    for (std::size_t f = 1; f < problem_.frames.size(); ++f) {
      const auto& motion = problem_.frames[f].motion;
      if (!motion || std::abs(motion->heading_rad) < kLeastTurn_rad || std::abs(motion->heading_rad) > 1) continue;
      Complex sum = 0;
      int count = 0;
      for (const ColourSighting& now : sightings(camera)[f]) {
        if (!is_first(sightings(camera)[f], now)) continue;
        const auto before = std::ranges::find(sightings(camera)[f - 1], now.landmark, &ColourSighting::landmark);
        if (before == sightings(camera)[f - 1].end()) continue;
        sum += unit(now.angle_rad - before->angle_rad);
        ++count;
      }
      if (count >= 2) turns.emplace_back(motion->heading_rad, std::arg(sum));
    }
    if (turns.size() < 3) return 0;
    double products = 0;
    double squares = 0;
    for (const auto& [body, image] : turns) {
      products += body * image;
      squares += body * body;
    }
    const double slope = products / squares;  // -1: as it is; +1: mirrored
    if (std::abs(std::abs(slope) - 1) > 0.5) return 0;
    double residuals = 0;
    for (const auto& [body, image] : turns) residuals += (image - slope * body) * (image - slope * body);
    const double sigma = std::sqrt(residuals / double(turns.size() - 1) / squares);
    return slope / std::max(sigma, 0.05);
  }

  double bearing_sign(Side camera) { return *view(camera).mirrored.value ? -1 : 1; }

  void find_relative_azimuth() {
    FoundAngle& azimuth = found_.relative_azimuth;
    azimuth.reason = found_.exchanged.reason;
    for (const Side camera : {Side::kLower, Side::kUpper}) {
      if (azimuth.reason == NotFound::kNothing) azimuth.reason = view(camera).mirrored.reason;
    }
    if (azimuth.reason != NotFound::kNothing) return;
    const Side of_lower = mirror_of(Side::kLower);  // the camera of the lower mirror: the relation is its own inverse
    const Side of_upper = other(of_lower);
    std::vector<Complex> differences;
    const Poses& lower = fit_of(of_lower, {bearing_sign(of_lower) < 0, Side::kLower}).poses;
    const Poses& upper = fit_of(of_upper, {bearing_sign(of_upper) < 0, Side::kUpper}).poses;
    for (std::size_t f = 0; f < problem_.frames.size(); ++f) {
      if (!lower[f] || !upper[f]) continue;
      for (const std::size_t i : lower[f]->fitted) {
        for (const std::size_t j : upper[f]->fitted) {
          const ColourSighting& a = sightings(of_lower)[f][i];
          const ColourSighting& b = sightings(of_upper)[f][j];
          if (a.landmark != b.landmark) continue;
          differences.push_back(unit(bearing_sign(of_lower) * a.angle_rad - bearing_sign(of_upper) * b.angle_rad));
        }
      }
    }
    set(differences, std::vector<double>(differences.size(), 1), 3, azimuth);
  }

  /// Sets the angle to the weighted mean of directions, with three rounds against outliers.
  /// @param least number of directions
  static void set(const std::vector<Complex>& directions, const std::vector<double>& weights, std::size_t least,
                  FoundAngle& angle) {
    angle.reason = NotFound::kUndecided;
    if (directions.size() < least) return;
    double middle = 0;
    double sigma = std::numbers::pi;
    for (int round = 0; round < 4; ++round) {
      Complex sum = 0;
      double weight = 0;
      double squares = 0;
      std::vector<double> off;
      for (std::size_t i = 0; i < directions.size(); ++i) {
        const double rad = std::arg(directions[i] * unit(-middle));
        if (round > 0 && std::abs(rad) > std::max(3 * sigma, 3 * kLeastAzimuthSigma_rad)) continue;
        sum += weights[i] * directions[i] / std::abs(directions[i]);
        weight += weights[i];
        squares += weights[i] * weights[i];
      }
      if (weight <= 0 || std::abs(sum) < weight / 2) return;  // they point everywhere
      middle = std::arg(sum);
      off.reserve(directions.size());
      for (const Complex& direction : directions) off.push_back(std::abs(std::arg(direction * unit(-middle))));
      sigma = base::robust_sigma(std::move(off));
      // Landmarks and frames share errors of tilts and centres: a tenth of them counts.
      constexpr double kIndependent = 0.1;
      const double count = std::max(1.0, kIndependent * weight * weight / squares);
      angle.sigma_rad = std::max(kLeastAzimuthSigma_rad, sigma / std::sqrt(count));
    }
    angle.rad = base::wrap_angle_rad(middle);
    angle.reason = NotFound::kNothing;
  }

  void find_azimuth() {
    FoundAngle& azimuth = found_.azimuth;
    azimuth.reason = found_.relative_azimuth.reason;
    if (azimuth.reason != NotFound::kNothing) return;
    const Side camera = mirror_of(Side::kLower);
    const Poses& poses = fit_of(camera, {bearing_sign(camera) < 0, Side::kLower}).poses;
    std::vector<Complex> directions;
    std::vector<double> weights;
    for (std::size_t f = 0; f < problem_.frames.size(); ++f) {
      const auto& heading = problem_.frames[f].heading_rad;
      if (!heading || !poses[f]) continue;
      directions.push_back(unit(poses[f]->heading_rad - *heading));
      weights.push_back(1);
    }
    if (!directions.empty()) return set(directions, weights, 1, azimuth);
    for (std::size_t f = 1; f < problem_.frames.size(); ++f) {
      const auto& motion = problem_.frames[f].motion;
      if (!motion || !poses[f] || !poses[f - 1]) continue;
      const Complex by_wheels(motion->x_m, motion->y_m);
      const Complex over_map = (poses[f]->place_m - poses[f - 1]->place_m) * unit(-poses[f - 1]->heading_rad);
      if (std::abs(by_wheels) < kPositionSigma_m || std::abs(over_map) < kPositionSigma_m) continue;
      // The image's x axis has the bearing `azimuth`, so that by_wheels = over_map turned by it.
      directions.push_back(by_wheels / over_map);
      const double sigma =
          std::hypot(std::sqrt(2.0) * kPositionSigma_m / std::abs(by_wheels), kTurnShare * motion->heading_rad);
      weights.push_back(1 / (sigma * sigma));
    }
    azimuth.reason = NotFound::kNoMotion;
    if (directions.size() < 3) return;
    set(directions, weights, 3, azimuth);
    if (azimuth.reason == NotFound::kNothing && azimuth.sigma_rad > kMostAzimuthSigma_rad) {
      azimuth = {{}, 0, NotFound::kNoMotion};
    }
  }

  const SelfRigProblem& problem_;
  std::vector<std::size_t> coloured_;  ///< the landmarks of table_'s colours
  ColourTable table_;
  SelfRig found_;
  std::array<Sightings, 2> sightings_;
  std::array<std::array<std::array<CameraFit, 2>, 2>, 2> fits_;  ///< by camera, mirrored, mirror
};

/// Returns the view's settings with the circle of the camera's image, undistorted by the view's lens.
MirrorViewSettings with_circle(const MirrorView& view, const Eigen::Vector2d& centre_px, double radius_px) {
  MirrorViewSettings s = view.settings();
  const MirrorViewSettings& believed = view.settings();
  s.centre_px = centre_px;
  s.rim_radius_px = radius_px;
  if (!view.has_distortion()) return s;
  // A lens without keys of its own is about the mirror's centre and in units of v, so it follows both.
  const bool follows_centre = s.distortion->principal_px == believed.centre_px;
  const bool follows_focal = s.distortion->focal_px == Eigen::Vector2d::Constant(view.focal_length_px());
  constexpr int kRounds = 4;
  constexpr int kPoints = 64;
  for (int round = 0; round < kRounds; ++round) {
    if (follows_centre) s.distortion->principal_px = s.centre_px;
    if (follows_focal) s.distortion->focal_px.setConstant(MirrorView(s).focal_length_px());
    const Lens lens(*s.distortion);
    const auto centre = lens.undistort(centre_px);
    if (!centre) return s;
    double sum = 0;
    int count = 0;
    for (int i = 0; i < kPoints; ++i) {
      const Complex out = unit(2 * std::numbers::pi * i / kPoints);
      const auto p = lens.undistort(centre_px + radius_px * Eigen::Vector2d(out.real(), out.imag()));
      if (!p) continue;
      sum += (*p - *centre).norm();
      ++count;
    }
    if (count == 0) return s;
    s.centre_px = *centre;
    s.rim_radius_px = sum / count;
  }
  return s;
}

}  // namespace

std::string_view to_string(NotFound reason) {
  constexpr std::array<std::string_view, 6> kNames{"found",       "no_mirror", "no_landmarks",
                                                   "not_the_map", "undecided", "no_motion"};
  return kNames.at(std::size_t(reason));
}

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

NotFound SelfRig::missing() const {
  if (exchanged.reason != NotFound::kNothing) return exchanged.reason;
  for (const SelfView& view : views) {
    if (view.mirrored.reason != NotFound::kNothing) return view.mirrored.reason;
  }
  return relative_azimuth.reason;
}

SelfRig find_rig(const SelfRigProblem& problem) {
  if (problem.frames.empty()) throw std::invalid_argument("find_rig: there is no frame, must be at least one");
  return RigSearch(problem).go();
}

Rig to_rig(const SelfRig& found, const SelfRigProblem& problem) {
  const bool exchanged = *found.exchanged.value;
  const auto camera_of = [&](Side mirror) {
    const bool is_lower = (mirror == Side::kLower) != exchanged;
    return is_lower ? Side::kLower : Side::kUpper;
  };
  const auto made = [&](Side mirror, double azimuth_rad) {
    const SelfView& seen = found.views[std::size_t(camera_of(mirror))];
    const MirrorView& believed = of_view(problem.rig, mirror);
    // The lens belongs to the camera, everything else to the mirror.
    MirrorViewSettings start = believed.settings();
    start.distortion = of_view(problem.rig, camera_of(mirror)).settings().distortion;
    MirrorViewSettings s = with_circle(MirrorView(start), seen.centre_px, seen.circle->radius_px);
    s.mirrored = *seen.mirrored.value;
    s.azimuth_rad = azimuth_rad;
    return MirrorView(s);
  };
  const double azimuth_rad = found.azimuth.rad.value_or(problem.rig.lower.settings().azimuth_rad);
  return {made(Side::kLower, azimuth_rad),
          made(Side::kUpper, base::wrap_angle_rad(azimuth_rad + *found.relative_azimuth.rad))};
}

}  // namespace twocone::vision

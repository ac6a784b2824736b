// SPDX-License-Identifier: Apache-2.0
#include "vision/self_rig.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <Eigen/Dense>

#include "base/quantile.h"
#include "vision/self_rig/camera_sight.h"

namespace twocone::vision {
namespace {

// By chance a further landmark agrees with a wrong pose with a probability of 2 kBearingLimit_rad / 2 pi: 0.06. Two
// more landmarks in agreement than the other answer explains happen by chance once in 250.
constexpr double kLeastSurplus = 2;
constexpr double kSurplusSigmas = 1.5;  // of one landmark, for the report: 0.06 is 1.5 sigmas
constexpr double kDecided = 3;          // sigmas
// Of the mean slope that a mirror shows, by its radius, its cone and its tilt.
constexpr double kSlopeSigma = 0.015;
// Of the wave that tilts of both mirrors by a degree make of a slope.
constexpr double kWaveSigma = 0.06;
constexpr double kHardlyKnown = 1e-6;  // 1 / sigma^2 of a number about which nothing is known
constexpr double kTiltSigma_rad = CalibrationPriors{}.tilt_rad;
// By so much all slopes of a view are wrong if its radius or cone is.
constexpr double kCommonSlopeSigma = 0.05;
// Both cameras show one mirror if the disparity is nearer to that of one mirror than this share of what the map needs.
constexpr double kSameMirror = 0.3;
// Position of one view's pose, and relative error of a turn by the wheels (5 % of separation or radius).
constexpr double kPositionSigma_m = 0.05;
constexpr double kTurnShare = 0.05;
constexpr double kLeastTurn_rad = 0.03;
constexpr double kMostAzimuthSigma_rad = 0.15;

/// Three numbers that explain values, rows * numbers.
struct ThreeFound {
  Eigen::Vector3d numbers;
  Eigen::Matrix3d covariance;
};

/// Returns the least squares whose sigma is that of the residuals, at least kSlopeSigma.
/// @param prior sigmas of the numbers about 0; 0: not known
ThreeFound fit_robustly(const std::vector<Eigen::Vector3d>& rows, const std::vector<double>& values,
                        const Eigen::Vector3d& prior) {
  const Eigen::Vector3d known =
      prior.unaryExpr([](double sigma) { return sigma > 0 ? 1 / (sigma * sigma) : kHardlyKnown; });
  ThreeFound found;
  double sigma = kWaveSigma;  // of one value
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d normal = known.asDiagonal();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      normal += rows[i] * rows[i].transpose() / (sigma * sigma);
      right += rows[i] * values[i] / (sigma * sigma);
    }
    found.covariance = normal.inverse();
    found.numbers = found.covariance * right;
    std::vector<double> off;
    off.reserve(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) off.push_back(std::abs(values[i] - rows[i].dot(found.numbers)));
    sigma = std::max(kSlopeSigma, base::robust_sigma(std::move(off)));
  }
  return found;
}

/// Returns the azimuth of a mirror's view; the body's direction is believed where it was not found.
double azimuth_of(Side mirror, const SelfRig& found, const SelfRigProblem& problem) {
  const double lower_rad = found.azimuth.rad.value_or(problem.rig.lower.settings().azimuth_rad);
  return mirror == Side::kLower ? lower_rad : base::wrap_angle_rad(lower_rad + *found.relative_azimuth.rad);
}

/// Work on one problem.
class RigSearch {
 public:
  explicit RigSearch(const SelfRigProblem& problem)
      : problem_(problem), sights_{sight_camera(problem, Side::kLower), sight_camera(problem, Side::kUpper)} {
    for (const Side camera : {Side::kLower, Side::kUpper}) view(camera) = sights_[std::size_t(camera)].view;
  }

  SelfRig go() {
    decide_exchanged();
    for (const Side camera : {Side::kLower, Side::kUpper}) decide_mirrored(camera);
    find_relative_azimuth();
    find_azimuth();
    for (const Side camera : {Side::kLower, Side::kUpper}) find_tilt(camera);
    return std::move(found_);
  }

 private:
  SelfView& view(Side camera) { return found_.views[std::size_t(camera)]; }
  [[nodiscard]] const Sightings& sightings(Side camera) const { return sights_[std::size_t(camera)].sightings; }
  [[nodiscard]] const CameraFit& fit_of(Side camera, const Guess& guess) const {
    return sights_[std::size_t(camera)].fit_of(guess);
  }
  static Side other(Side side) { return side == Side::kLower ? Side::kUpper : Side::kLower; }

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
    for_each_pair([&](std::size_t /*frame*/, const ColourSighting& lower, const ColourSighting& upper) {
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
      const RimMeasurement& circle = *view(camera).circle;
      return std::max(kFoundRadiusShare, circle.sigma_radius_px / circle.radius_px);
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
  /// lower mirror shows a top at the greater slope, by the separation of the mirrors over the top's distance. Tilts of
  /// the mirrors add a wave once round; it is found with the share of the separation that the images show.
  void decide_exchanged_by_slopes() {
    Decision& exchanged = found_.exchanged;
    const MirrorView lower = upright_view(problem_.rig, Side::kLower, view(Side::kLower).circle->radius_px);
    const MirrorView upper = upright_view(problem_.rig, Side::kUpper, view(Side::kUpper).circle->radius_px);
    const Poses& poses = sights_[0].best_fit().poses;
    const double separation_m = tip_m(Side::kUpper) - tip_m(Side::kLower);
    std::vector<Eigen::Vector3d> rows;
    std::vector<double> differences;
    for_each_pair([&](std::size_t f, const ColourSighting& in_lower, const ColourSighting& in_upper) {
      if (!poses[f]) return;
      rows.emplace_back(separation_m / std::abs(place_of(problem_.landmarks[in_lower.landmark]) - poses[f]->place_m),
                        std::cos(in_lower.angle_rad), std::sin(in_lower.angle_rad));
      differences.push_back(std::tan(lower.elevation_rad(in_lower.top_px)) -
                            std::tan(upper.elevation_rad(in_upper.top_px)));
    });
    if (rows.size() < 3) return;
    const ThreeFound found = fit_robustly(rows, differences, {0, kWaveSigma, kWaveSigma});
    double mean = 0;
    for (const Eigen::Vector3d& row : rows) mean += row[0] / double(rows.size());
    const double share = found.numbers[0];
    const double sigma_share = std::hypot(std::sqrt(found.covariance(0, 0)), kSlopeSigma / mean);
    exchanged.sigmas = std::abs(share) / sigma_share;
    if (exchanged.sigmas < kDecided) {
      found_.shows_one_mirror = std::abs(share) < kSameMirror && sigma_share < kSameMirror / 2;
      return;
    }
    exchanged.value = share < 0;
    exchanged.reason = NotFound::kNothing;
  }

  /// Calls `use` with the frame and the sightings, in the lower and the upper camera, of each landmark that both see in
  /// a frame, inside their rims.
  template <typename Use>
  void for_each_pair(const Use& use) {
    for (std::size_t f = 0; f < problem_.frames.size(); ++f) {
      const std::vector<ColourSighting>& in_lower = sightings(Side::kLower)[f];
      const std::vector<ColourSighting>& in_upper = sightings(Side::kUpper)[f];
      for (const ColourSighting& a : in_lower) {
        for (const ColourSighting& b : in_upper) {
          if (a.landmark != b.landmark || a.at_rim || b.at_rim) continue;
          if (is_first(in_lower, a) && is_first(in_upper, b)) use(f, a, b);
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
    std::vector<double> sigmas;
    for (std::size_t f = 0; f < problem_.frames.size(); ++f) {
      const auto& heading = problem_.frames[f].heading_rad;
      if (!heading || !poses[f]) continue;
      directions.push_back(unit(poses[f]->heading_rad - *heading));
      weights.push_back(1);
      sigmas.push_back(poses[f]->sigma_heading_rad);
    }
    if (!directions.empty()) {
      set(directions, weights, 1, azimuth);
      azimuth.sigma_rad = std::max(azimuth.sigma_rad, base::median(std::move(sigmas)));
      return;
    }
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

  void find_tilt(Side camera) {
    SelfView& v = view(camera);
    if (!found_.relative_azimuth.rad) return;
    const Side mirror = mirror_of(camera);
    MirrorViewSettings settings = upright_view(problem_.rig, mirror, v.circle->radius_px).settings();
    settings.azimuth_rad = azimuth_of(mirror, found_, problem_);
    settings.mirrored = *v.mirrored.value;
    // Both axes, and none.
    constexpr double kStep_rad = 1e-3;
    std::vector<MirrorView> views;
    for (const Eigen::Vector2d& tilt : {Eigen::Vector2d(kStep_rad, 0), {0, kStep_rad}, {0, 0}}) {
      settings.tilt_rad = tilt;
      views.emplace_back(settings);
    }
    std::vector<Eigen::Vector3d> rows;
    std::vector<double> errors;
    const Poses& poses = fit_of(camera, {settings.mirrored, mirror}).poses;
    for (std::size_t f = 0; f < poses.size(); ++f) {
      if (!poses[f]) continue;
      for (const std::size_t i : poses[f]->fitted) {
        const ColourSighting& sighting = sightings(camera)[f][i];
        if (sighting.at_rim) continue;
        const Landmark& landmark = problem_.landmarks[sighting.landmark];
        const double distance_m = std::abs(place_of(landmark) - poses[f]->place_m);
        std::array<std::optional<double>, 3> error;
        for (std::size_t k = 0; k < views.size(); ++k) error[k] = slope_error(views[k], sighting, landmark, distance_m);
        if (!error[0] || !error[1] || !error[2]) continue;
        rows.emplace_back((*error[0] - *error[2]) / kStep_rad, (*error[1] - *error[2]) / kStep_rad, 1);
        errors.push_back(-*error[2]);
      }
    }
    if (rows.size() < kLeastRigLandmarks) return;
    const ThreeFound found = fit_robustly(rows, errors, {kTiltSigma_rad, kTiltSigma_rad, kCommonSlopeSigma});
    v.tilt_rad = found.numbers.head<2>();
    v.sigma_tilt_rad = std::max(kLeastTiltSigma_rad, std::sqrt(found.covariance.diagonal().head<2>().maxCoeff()));
  }

  const SelfRigProblem& problem_;
  std::array<CameraSight, 2> sights_;
  SelfRig found_;
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
  const auto made = [&](Side mirror) {
    const SelfView& seen = found.views[std::size_t(camera_of(mirror))];
    const MirrorView& believed = of_view(problem.rig, mirror);
    // The lens belongs to the camera, everything else to the mirror.
    MirrorViewSettings start = believed.settings();
    start.distortion = of_view(problem.rig, camera_of(mirror)).settings().distortion;
    MirrorViewSettings s = with_circle(MirrorView(start), seen.centre_px, seen.circle->radius_px);
    s.mirrored = *seen.mirrored.value;
    s.azimuth_rad = azimuth_of(mirror, found, problem);
    s.tilt_rad = seen.tilt_rad.value_or(s.tilt_rad);
    return MirrorView(s);
  };
  return {made(Side::kLower), made(Side::kUpper)};
}

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#include "vision/calibration/bundle.h"

#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "base/errors.h"

namespace twocone::vision::calibration {
namespace {

// Number of rings of the rim's radius. Sightings in one ring are taken to share an error.
constexpr std::size_t kRings = 16;

// Half a degree of tilt is 6 px of radius or some 0.15 m of range at 2.5 m in the lab's mirrors; wrong matches are
// farther off.
constexpr double kAgree_m = 0.4;

struct Match {
  std::size_t landmark;
  Eigen::Vector2d body_m;
  Eigen::Vector2d world_m;
};

/// Computes the least-squares rigid motion (Umeyama without scale, in the plane).
Eigen::Vector3d best_pose(const std::vector<const Match*>& matches) {
  Eigen::Vector2d body = Eigen::Vector2d::Zero();
  Eigen::Vector2d world = Eigen::Vector2d::Zero();
  for (const Match* m : matches) {
    body += m->body_m / double(matches.size());
    world += m->world_m / double(matches.size());
  }
  double cosine = 0;
  double sine = 0;
  for (const Match* m : matches) {
    const Eigen::Vector2d b = m->body_m - body;
    const Eigen::Vector2d w = m->world_m - world;
    cosine += b.dot(w);
    sine += b.x() * w.y() - b.y() * w.x();
  }
  const double heading = std::atan2(sine, cosine);
  const Eigen::Vector2d place = world - Eigen::Rotation2Dd(heading) * body;
  return {place.x(), place.y(), heading};
}

std::vector<const Match*> agreeing(const std::vector<Match>& matches, const Eigen::Vector3d& pose) {
  std::vector<const Match*> agree;
  for (const Match& m : matches) {
    const Eigen::Vector2d seen = pose.head<2>() + Eigen::Rotation2Dd(pose.z()) * m.body_m;
    if ((seen - m.world_m).norm() <= kAgree_m) agree.push_back(&m);
  }
  return agree;
}

/// Returns a start pose (x m, y m, heading rad). Each sighting gives the landmark's place in the body frame (its ray
/// meets the known height of the top). The pose is the rotation and translation with which most of these places agree,
/// tried for every two landmarks. Returns nothing where fewer than two landmarks agree to kAgree_m.
std::optional<Eigen::Vector3d> start_pose(const Rig& rig, const std::vector<Landmark>& landmarks,
                                          const CalibrationFrame& frame) {
  std::vector<Match> matches;
  for (const LandmarkSighting& s : frame.sightings) {
    const Landmark& landmark = landmarks[s.landmark];
    const MirrorView& view = of_view(rig, s.side);
    const auto ray = view.back_project(s.sighting.pixel_px);
    const auto place = ray ? axis_at_height(view, *ray, landmark.radius_m, landmark.top_m) : std::nullopt;
    if (place) matches.push_back({s.landmark, *place, place_m(landmark)});
  }
  std::vector<const Match*> most;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    for (std::size_t j = i + 1; j < matches.size(); ++j) {
      if (matches[i].landmark == matches[j].landmark) continue;
      auto agree = agreeing(matches, best_pose({&matches[i], &matches[j]}));
      if (agree.size() > most.size()) most = std::move(agree);
    }
  }
  if (!show_two_landmarks(most, &Match::landmark)) return std::nullopt;
  return best_pose(most);
}

// Error in every direction from the floor's unevenness and the approximation by arcs: a tenth of a millimetre. Without
// it the covariance of a single arc would be singular across the arc.
constexpr double kFloor_m = 1e-4;

double mean_decay(double x) { return x < 1e-8 ? 1 - x / 2 : -std::expm1(-x) / x; }

/// Computes the covariance of (x, y, heading) at the interval's end relative to its beginning, from errors other than
/// the mean slips. These are the resolution of the readings at both ends, and slip that changes within the interval,
/// which is taken as independent for each reading.
Eigen::Matrix3d way_covariance(const WheelRow& row, double duration_s, const WheelBelief& wheels) {
  const double radius = wheels.radius_m;
  std::vector<Eigen::Vector3d> middles;  // pose in the middle of each arc
  Eigen::Vector3d pose = Eigen::Vector3d::Zero();
  for (const Eigen::Vector2d& turns : row.turns_rad) {
    const double way = radius * (turns.x() + turns.y()) / 2;
    const double turn = radius * (turns.y() - turns.x()) / wheels.separation_m;
    const double heading = pose.z() + turn / 2;
    middles.emplace_back(pose.x() + way / 2 * std::cos(heading), pose.y() + way / 2 * std::sin(heading), heading);
    pose += Eigen::Vector3d(way * std::cos(heading), way * std::sin(heading), turn);
  }
  // Within an interval of x time constants, the slip has a variance of x / 3 about its mean (first order in x).
  const double wander = wheels.slip * std::sqrt(std::min(1.0, duration_s / wheels.slip_correlation_s / 3));
  const double step_m = radius * wheels.angle_step_rad / std::sqrt(12.0);  // sigma of one reading: uniform over a step
  Eigen::Matrix3d covariance = Eigen::Vector3d(1, 1, 1 / wheels.separation_m).cwiseAbs2().asDiagonal();
  covariance *= kFloor_m * kFloor_m;
  for (std::size_t i = 0; i < middles.size(); ++i) {
    const double c = std::cos(middles[i].z());
    const double s = std::sin(middles[i].z());
    for (const int wheel : {0, 1}) {
      // Half of the wheel's travel moves the body forward; the turn rotates the rest of the motion.
      const double turn = (wheel == 1 ? 1 : -1) / wheels.separation_m;
      const Eigen::Vector3d effect(c / 2 - turn * (pose.y() - middles[i].y()),
                                   s / 2 + turn * (pose.x() - middles[i].x()), turn);
      const double sigma_m = wander * radius * row.turns_rad[i][wheel];
      covariance += sigma_m * sigma_m * effect * effect.transpose();
      if (i == 0 || i + 1 == middles.size()) covariance += step_m * step_m * effect * effect.transpose();
    }
  }
  return covariance;
}

/// Makes a row for every two consecutive frames of the list between which the wheels were read.
///
/// The slip of an interval is the mean over the interval of a Gauss-Markov process with time constant tau and
/// variance 1. With x = dt / tau its variance is 2 (x - 1 + exp(-x)) / x^2, and its covariance with the previous
/// interval is (1 - exp(-x)) (1 - exp(-y)) / (x y). Memory beyond one interval is neglected: up to the square of x, it
/// is that of a first-order process.
/// @param needs_twists whether a row is left out if one of its ends has no twist, because its latency would count as 0
std::vector<WheelRow> wheel_rows(const std::vector<CalibrationFrame>& frames, const WheelBelief& wheels,
                                 bool needs_twists) {
  std::vector<WheelRow> rows;
  double last_x = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const std::vector<WheelReading>& readings = frames[i].wheels;
    if (readings.size() < 2) continue;
    const auto& from_twist = frames[i - 1].twist;
    const auto& to_twist = frames[i].twist;
    if (needs_twists && !(from_twist && to_twist)) continue;
    const double duration_s = readings.back().t_s - readings.front().t_s;
    if (!(duration_s > 0)) continue;
    WheelRow row;
    row.frame = i;
    row.from_twist = from_twist.value_or(BodyTwist{});
    row.to_twist = to_twist.value_or(BodyTwist{});
    for (std::size_t k = 1; k < readings.size(); ++k) {
      row.turns_rad.emplace_back(readings[k].left_rad - readings[k - 1].left_rad,
                                 readings[k].right_rad - readings[k - 1].right_rad);
    }
    const Eigen::Matrix3d factor = way_covariance(row, duration_s, wheels).llt().matrixL();
    row.whitener = factor.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity());
    const double x = duration_s / wheels.slip_correlation_s;
    const double variance = mean_slip_variance(x);
    row.follows = !rows.empty() && rows.back().frame + 1 == i;
    if (row.follows) {
      const double covariance = mean_decay(last_x) * mean_decay(x);
      row.slip_share = covariance / mean_slip_variance(last_x);
      row.slip_sigma = std::sqrt(std::max(1e-6, variance - row.slip_share * covariance));
    } else {
      row.slip_sigma = std::sqrt(variance);
    }
    last_x = x;
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Returns the distance from a landmark to the one farthest from it; empty where there is none, or no uncertain radius.
std::optional<BundleData::DistanceRow> radius_scale(std::size_t landmark, const std::vector<Landmark>& landmarks) {
  const Landmark& of = landmarks[landmark];
  const auto distance_m = [&of](const Landmark& other) { return (place_m(other) - place_m(of)).norm(); };
  const auto farthest = std::ranges::max_element(landmarks, {}, distance_m);
  const double sigma_m = of.sigma.radius_m / of.radius_m * distance_m(*farthest);
  if (sigma_m == 0) return std::nullopt;
  const auto to = std::size_t(farthest - landmarks.begin());
  return BundleData::DistanceRow{{landmark, to, distance_m(*farthest), sigma_m}, of, *farthest};
}

}  // namespace

double mean_slip_variance(double x) {
  // Each time x is ten times smaller, the closed form loses two digits: below 1e-4 the series is better.
  return x < 1e-4 ? 1 - x / 3 : 2 * (x + std::expm1(-x)) / (x * x);
}

void check(const CalibrationProblem& problem) {
  base::Complaints bad;
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i) {
    const Landmark& l = problem.landmarks[i];
    bad.require(place_m(l).allFinite() && std::isfinite(l.top_m) && base::is_positive(l.radius_m),
                "landmark {} must have a finite place and top and a radius > 0 m", i);
    bad.require(sigmas_of(l).allFinite() && sigmas_of(l).minCoeff() >= 0,
                "landmark {} has a sigma that is not finite or below 0 m", i);
  }
  for (std::size_t i = 0; i < problem.frames.size(); ++i) {
    for (const LandmarkSighting& s : problem.frames[i].sightings) {
      bad.require(s.landmark < problem.landmarks.size(), "frame {} has a sighting of landmark {}, there are {}", i,
                  s.landmark, problem.landmarks.size());
      bad.require(s.sighting.pixel_px.allFinite() && s.sighting.covariance_px2.allFinite() &&
                      s.sighting.covariance_px2.llt().info() == Eigen::Success,
                  "frame {} has a sighting whose pixel is not finite or whose covariance is not positive definite", i);
    }
    const auto& sightings = problem.frames[i].sightings;
    bad.require(std::ranges::all_of(sightings, [](const LandmarkSighting& s) { return std::isfinite(s.late_s); }),
                "frame {} has a sighting whose late_s is not finite", i);
    const BodyTwist twist = problem.frames[i].twist.value_or(BodyTwist{});
    bad.require(std::isfinite(twist.forward_mps) && std::isfinite(twist.turn_radps),
                "frame {} has a twist that is not finite", i);
    const auto& start = problem.frames[i].start;
    bad.require(!start || start->allFinite(), "frame {} has a start pose that is not finite", i);
    const auto& wheels = problem.frames[i].wheels;
    for (std::size_t k = 0; k < wheels.size(); ++k) {
      bad.require(std::isfinite(wheels[k].t_s) && std::isfinite(wheels[k].left_rad) &&
                      std::isfinite(wheels[k].right_rad) && (k == 0 || wheels[k].t_s >= wheels[k - 1].t_s),
                  "frame {} has wheel readings that are not finite or run backwards", i);
    }
  }
  bad.require(problem.systematic_px >= 0 && std::isfinite(problem.systematic_px), "systematic_px must be >= 0");
  bad.require(problem.distortion_sigma >= 0 && std::isfinite(problem.distortion_sigma),
              "distortion_sigma must be >= 0");
  bad.require(problem.height_px[0] >= 0 && problem.height_px[1] >= 0, "height_px must be >= 0");
  const CalibrationPriors& p = problem.priors;
  for (const double prior :
       {p.length_m, p.mirror_separation_m, p.lens_height_m, p.centre_px, p.rim_share, p.azimuth_rad, p.tilt_rad,
        p.axis_offset_m, p.lower_axis_offset_m, p.apex_rad, p.distortion, p.wheel_radius_share, p.wheel_ratio,
        p.wheel_separation_m, p.latency_s, p.skew_s, p.readout_s}) {
    bad.require(base::is_positive(prior), "a prior's sigma is {}, must be > 0", prior);
  }
  bad.require(!problem.first_pose_covariance || (problem.first_pose_covariance->allFinite() &&
                                                 problem.first_pose_covariance->llt().info() == Eigen::Success),
              "the first pose's covariance is not positive definite");
  for (const MeasuredDistance& d : problem.distances) {
    bad.require(d.from < problem.landmarks.size() && d.to < problem.landmarks.size() && d.from != d.to &&
                    base::is_positive(d.distance_m) && base::is_positive(d.sigma_m),
                "the distance from landmark {} to {} is {} +- {} m, must be > 0 between two landmarks", d.from, d.to,
                d.distance_m, d.sigma_m);
  }
  if (problem.wheels) {
    const WheelBelief& w = *problem.wheels;
    bad.require(base::is_positive(w.radius_m) && base::is_positive(w.separation_m) && base::is_positive(w.slip) &&
                    base::is_positive(w.slip_correlation_s) && w.angle_step_rad >= 0 && std::isfinite(w.angle_step_rad),
                "wheels must have radius, separation, slip and its correlation > 0 and an angle step >= 0");
  }
  for (const auto& rim : {problem.lower_rim, problem.upper_rim}) {
    bad.require(!rim || (rim->centre_px.allFinite() && base::is_positive(rim->radius_px) &&
                         base::is_positive(rim->sigma_centre_px) && base::is_positive(rim->sigma_radius_px)),
                "a rim must be finite, with radius and sigmas > 0");
  }
  bad.raise("calibrate");
}

Bundle bundle_of(const CalibrationProblem& problem) {
  Bundle bundle{{SharedModel(problem), {}, {}, {}}, {}, {}, {}};
  // The wheel readings of a frame that is left out belong to the next frame's motion.
  std::vector<CalibrationFrame> kept;
  std::vector<WheelReading> before;
  bool broken = false;
  for (std::size_t i = 0; i < problem.frames.size(); ++i) {
    const CalibrationFrame& frame = problem.frames[i];
    broken = broken || frame.wheels.size() < 2;
    std::vector<WheelReading> wheels = before;
    // The first reading repeats the last one of the previous frame.
    wheels.insert(wheels.end(), frame.wheels.begin() + (before.empty() || frame.wheels.empty() ? 0 : 1),
                  frame.wheels.end());
    const bool starts_itself = frame.start && show_two_landmarks(frame.sightings, &LandmarkSighting::landmark);
    const auto pose = starts_itself ? frame.start : start_pose(problem.rig, problem.landmarks, frame);
    if (!pose) {
      before = std::move(wheels);
      continue;
    }
    kept.push_back({frame.sightings, broken ? std::vector<WheelReading>{} : std::move(wheels), frame.twist, {}});
    before.clear();
    broken = false;
    const std::size_t index = bundle.start.poses.size();
    bundle.start.poses.push_back(*pose);
    bundle.frames.push_back(i);
    for (std::size_t k = 0; k < frame.sightings.size(); ++k) {
      const LandmarkSighting& s = frame.sightings[k];
      const Eigen::Matrix2d factor = s.sighting.covariance_px2.llt().matrixL();
      SightingRow& row = bundle.data.sightings.emplace_back();
      row.frame = index;
      row.side = s.side;
      row.landmark_index = s.landmark;
      row.landmark = problem.landmarks[s.landmark];
      row.twist = frame.twist.value_or(BodyTwist{});
      row.late_s = s.late_s;
      row.pixel_px = s.sighting.pixel_px;
      row.whitener = factor.triangularView<Eigen::Lower>().solve(Eigen::Matrix2d::Identity());
      const MirrorView& view = of_view(problem.rig, s.side);
      const Eigen::Vector2d from_tip = s.sighting.pixel_px - view.settings().centre_px;
      const auto ring = std::size_t(std::min(from_tip.norm() / view.settings().rim_radius_px * kRings, kRings - 1.0));
      const auto view_index = std::size_t(s.side);
      row.readout_share = readout_share(s.sighting, problem.height_px[view_index]);
      const std::size_t group = 2 * s.landmark + view_index;
      const std::size_t rings_from = 2 * problem.landmarks.size();
      row.groups = {group, rings_from + view_index * kRings + ring, rings_from + (2 + group) * kRings + ring};
      const Eigen::Vector2d out = from_tip.stableNormalized();
      row.axes << out.x(), -out.y(), out.y(), out.x();
      bundle.origins.push_back({.frame = i, .sighting = k});
    }
  }
  if (problem.wheels) bundle.data.wheels = wheel_rows(kept, *problem.wheels, bundle.data.model.sigma[kLatency] > 0);
  bundle.data.groups = 2 * problem.landmarks.size() * (1 + kRings) + 2 * kRings;
  bundle.start.biases.assign(bundle.data.groups, Eigen::Vector2d::Zero());
  bundle.start.landmarks.assign(problem.landmarks.size(), LandmarkVector::Zero());
  bundle.data.moves_landmarks =
      std::ranges::any_of(problem.landmarks, [](const Landmark& l) { return sigmas_of(l).maxCoeff() > 0; });
  if (problem.first_pose_covariance && !bundle.start.poses.empty()) {
    const Eigen::Matrix3d factor = problem.first_pose_covariance->llt().matrixL();
    bundle.data.first_pose = {bundle.start.poses.front(),
                              factor.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity())};
  }
  for (const MeasuredDistance& d : problem.distances) {
    bundle.data.distances.push_back({d, problem.landmarks[d.from], problem.landmarks[d.to]});
  }
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i) {
    bundle.data.radius_scales.push_back(problem.radii_follow_scale ? radius_scale(i, problem.landmarks) : std::nullopt);
  }
  bundle.start.slips.assign(bundle.data.wheels.size(), Eigen::Vector2d::Zero());
  if (problem.lower_rim) bundle.data.rims.push_back({Side::kLower, *problem.lower_rim});
  if (problem.upper_rim) bundle.data.rims.push_back({Side::kUpper, *problem.upper_rim});
  return bundle;
}

}  // namespace twocone::vision::calibration

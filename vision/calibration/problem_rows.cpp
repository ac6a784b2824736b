// SPDX-License-Identifier: Apache-2.0
#include "vision/calibration/problem_rows.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "vision/calibration/start_pose.h"
#include "vision/calibration/wheel_rows.h"

namespace twocone::vision::calibration {
namespace {

// Number of rings of the rim's radius. Sightings in one ring are taken to share an error.
constexpr std::size_t kRings = 16;

}  // namespace

void check(const CalibrationProblem& problem) {
  std::string bad;
  const auto require = [&bad](bool good, const std::string& what) {
    if (!good) bad += " " + what + ";";
  };
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i) {
    const Landmark& l = problem.landmarks[i];
    require(place_m(l).allFinite() && std::isfinite(l.top_m) && positive(l.radius_m),
            fmt::format("landmark {} must have a finite place and top and a radius > 0 m", i));
  }
  for (std::size_t i = 0; i < problem.frames.size(); ++i) {
    for (const LandmarkSighting& s : problem.frames[i].sightings) {
      require(s.landmark < problem.landmarks.size(), fmt::format("frame {} has a sighting of landmark {}, there are {}",
                                                                 i, s.landmark, problem.landmarks.size()));
      require(s.sighting.pixel_px.allFinite() && s.sighting.covariance_px2.allFinite() &&
                  s.sighting.covariance_px2.llt().info() == Eigen::Success,
              fmt::format(
                  "frame {} has a sighting whose pixel is not finite or whose covariance is not positive definite", i));
    }
    const auto& sightings = problem.frames[i].sightings;
    require(std::ranges::all_of(sightings, [](const LandmarkSighting& s) { return std::isfinite(s.late_s); }),
            fmt::format("frame {} has a sighting whose late_s is not finite", i));
    const BodyTwist twist = problem.frames[i].twist.value_or(BodyTwist{});
    require(std::isfinite(twist.forward_mps) && std::isfinite(twist.turn_radps),
            fmt::format("frame {} has a twist that is not finite", i));
    const auto& wheels = problem.frames[i].wheels;
    for (std::size_t k = 0; k < wheels.size(); ++k) {
      require(std::isfinite(wheels[k].t_s) && std::isfinite(wheels[k].left_rad) && std::isfinite(wheels[k].right_rad) &&
                  (k == 0 || wheels[k].t_s >= wheels[k - 1].t_s),
              fmt::format("frame {} has wheel readings that are not finite or run backwards", i));
    }
  }
  require(problem.systematic_px >= 0 && std::isfinite(problem.systematic_px), "systematic_px must be >= 0");
  require(problem.landmark_sigma_m >= 0 && std::isfinite(problem.landmark_sigma_m), "landmark_sigma_m must be >= 0");
  require(problem.height_px[0] >= 0 && problem.height_px[1] >= 0, "height_px must be >= 0");
  const CalibrationPriors& p = problem.priors;
  for (const double prior : {p.length_m, p.centre_px, p.rim_share, p.azimuth_rad, p.tilt_rad, p.axis_offset_m,
                             p.lower_axis_offset_m, p.apex_rad, p.distortion, p.wheel_radius_share, p.wheel_ratio,
                             p.wheel_separation_m, p.latency_s, p.skew_s, p.readout_s}) {
    require(positive(prior), fmt::format("a prior's sigma is {}, must be > 0", prior));
  }
  if (problem.wheels) {
    const WheelBelief& w = *problem.wheels;
    require(positive(w.radius_m) && positive(w.separation_m) && positive(w.slip) && positive(w.slip_correlation_s) &&
                w.angle_step_rad >= 0 && std::isfinite(w.angle_step_rad),
            "wheels must have radius, separation, slip and its correlation > 0 and an angle step >= 0");
  }
  for (const auto& rim : {problem.lower_rim, problem.upper_rim}) {
    require(!rim || (rim->centre_px.allFinite() && positive(rim->radius_px) && positive(rim->sigma_centre_px) &&
                     positive(rim->sigma_radius_px)),
            "a rim must be finite, with radius and sigmas > 0");
  }
  if (!bad.empty()) throw std::invalid_argument("calibrate:" + bad);
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
    const auto pose = start_pose(problem.rig, problem.landmarks, frame);
    if (!pose) {
      before = std::move(wheels);
      continue;
    }
    kept.push_back({frame.sightings, broken ? std::vector<WheelReading>{} : std::move(wheels), frame.twist});
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
      const MirrorView& view = s.side == Side::kLower ? problem.rig.lower : problem.rig.upper;
      const Eigen::Vector2d from_tip = s.sighting.pixel_px - view.settings().centre_px;
      const auto ring = std::size_t(std::min(from_tip.norm() / view.settings().rim_radius_px * kRings, kRings - 1.0));
      const std::size_t view_index = s.side == Side::kLower ? 0 : 1;
      const int height_px = problem.height_px[view_index];
      if (height_px > 1) row.readout_share = s.sighting.pixel_px.y() / (height_px - 1) - 0.5;
      const std::size_t group = 2 * s.landmark + view_index;
      const std::size_t rings_from = 2 * problem.landmarks.size();
      row.groups = {group, rings_from + view_index * kRings + ring, rings_from + (2 + group) * kRings + ring};
      const Eigen::Vector2d out = from_tip.stableNormalized();
      row.axes << out.x(), -out.y(), out.y(), out.x();
      SightingResidual& origin = bundle.origins.emplace_back();
      origin.frame = i;
      origin.sighting = k;
    }
  }
  if (problem.wheels) bundle.data.wheels = wheel_rows(kept, *problem.wheels, bundle.data.model.sigma[kLatency] > 0);
  bundle.data.groups = 2 * problem.landmarks.size() * (1 + kRings) + 2 * kRings;
  bundle.start.biases.assign(bundle.data.groups, Eigen::Vector2d::Zero());
  bundle.start.landmarks.assign(problem.landmarks.size(), Eigen::Vector2d::Zero());
  bundle.start.slips.assign(bundle.data.wheels.size(), Eigen::Vector2d::Zero());
  if (problem.lower_rim) bundle.data.rims.push_back({Side::kLower, *problem.lower_rim});
  if (problem.upper_rim) bundle.data.rims.push_back({Side::kUpper, *problem.upper_rim});
  return bundle;
}

}  // namespace twocone::vision::calibration

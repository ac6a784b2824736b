// SPDX-License-Identifier: Apache-2.0
#include "vision/calibration/bundle.h"

#include <algorithm>
#include <cmath>

#include "base/plane.h"
#include "vision/calibration/bundle_rows.h"

namespace twocone::vision::calibration {
namespace {

constexpr std::array<const char*, int(kSharedNumbers) - int(kRigNumbers)> kOtherNames{
    "wheel_radius_m", "wheel_ratio",     "wheel_separation_m", "latency_s",
    "upper.skew_s",   "lower.readout_s", "upper.readout_s"};

void take_view(SharedModel& model, const MirrorView& view, Side side, const CalibrationProblem& problem) {
  const MirrorViewSettings& s = view.settings();
  const CalibrationPriors& priors = problem.priors;
  const auto set = [&model, side](int number, double mean, double sigma) {
    model.mean[rig_number(side, number)] = mean;
    model.sigma[rig_number(side, number)] = sigma;
  };
  set(kColumn, s.centre_px.x(), priors.centre_px);
  set(kRow, s.centre_px.y(), priors.centre_px);
  set(kRim, s.rim_radius_px, priors.rim_share * s.rim_radius_px);
  set(kAzimuth, s.azimuth_rad, priors.azimuth_rad);
  set(kTiltX, s.tilt_rad.x(), priors.tilt_rad);
  set(kTiltY, s.tilt_rad.y(), priors.tilt_rad);
  const double offset_sigma_m = side == Side::kLower ? priors.lower_axis_offset_m : priors.axis_offset_m;
  set(kOffsetX, s.axis_offset_m.x(), offset_sigma_m);
  set(kOffsetY, s.axis_offset_m.y(), offset_sigma_m);
  set(kApex, s.cone.apex_rad, priors.apex_rad);
  set(kMirrorRadius, s.cone.rim_radius_m, priors.length_m);
  set(kLensToTip, s.cone.lens_to_tip_m, priors.length_m);

  ViewConstants& constants = model.views[side == Side::kLower ? 0 : 1];
  constants.sense = s.mirrored ? -1 : 1;
  const double distortion_sigma = problem.fit_distortion ? priors.distortion : problem.distortion_sigma;
  constants.has_lens = distortion_sigma > 0 || view.has_distortion();
  constants.focal_px.setConstant(view.focal_length_px());
  constants.principal_px = s.lens_axis_px.value_or(s.centre_px);
  std::array<double, 8> k{};
  if (s.distortion) {
    constants.focal_px = s.distortion->focal_px;
    constants.principal_px = s.distortion->principal_px;
    constants.lens_terms = s.distortion->coefficients.size();
    std::copy(s.distortion->coefficients.begin(), s.distortion->coefficients.end(), k.begin());
  }
  std::copy(k.begin() + 2, k.end(), constants.further.begin());
  set(kK1, k[0], distortion_sigma);
  set(kK2, k[1], distortion_sigma);
}

void take_times(SharedModel& model, const CalibrationProblem& problem) {
  const auto& [lower, upper] = problem.rig.exposures;
  model.mean[kLatency] = 0 - lower.late_s;  // 0 - 0 is no negative zero
  model.mean[kSkew] = upper.late_s - lower.late_s;
  model.mean[kLowerReadout] = lower.readout_s;
  model.mean[kUpperReadout] = upper.readout_s;
  if (!problem.fit_timing) return;
  if (std::ranges::none_of(problem.frames, [](const CalibrationFrame& f) { return f.twist.has_value(); })) return;
  const CalibrationPriors& priors = problem.priors;
  model.sigma[kSkew] = priors.skew_s;
  if (problem.height_px[0] > 1) model.sigma[kLowerReadout] = priors.readout_s;
  if (problem.height_px[1] > 1) model.sigma[kUpperReadout] = priors.readout_s;
  if (problem.wheels) model.sigma[kLatency] = priors.latency_s;
}

/// Returns the matrix that maps errors of what is believed (rig, then times of exposure) to those of the shared
/// numbers.
Eigen::MatrixXd shared_by_belief() {
  Eigen::MatrixXd by = Eigen::MatrixXd::Zero(kSharedNumbers, int(kRigNumbers) + int(kTimeNumbers));
  for (int i = 0; i < kRigNumbers; ++i) by(i, i) = 1;
  for (const int relative : {kAzimuth, kOffsetX, kOffsetY}) {
    by(rig_number(Side::kUpper, relative), rig_number(Side::kLower, relative)) = -1;
  }
  constexpr int kTimes = kRigNumbers;
  by(kLatency, kTimes + kLateOfLower) = -1;
  by(kSkew, kTimes + kLateOfUpper) = 1;
  by(kSkew, kTimes + kLateOfLower) = -1;
  by(kLowerReadout, kTimes + kReadoutOfLower) = 1;
  by(kUpperReadout, kTimes + kReadoutOfUpper) = 1;
  return by;
}

/// Holds rig and times, with the covariance of that belief.
void hold(SharedModel& model, const BeliefErrors& errors) {
  const Eigen::Index count = std::max(errors.rig.cols(), errors.times.cols());
  Eigen::MatrixXd by_shared = Eigen::MatrixXd::Zero(int(kRigNumbers) + int(kTimeNumbers), count);
  if (errors.rig.cols() > 0) by_shared.topRows<kRigNumbers>() = errors.rig;
  if (errors.times.cols() > 0) by_shared.bottomRows<kTimeNumbers>() = errors.times;
  const Eigen::MatrixXd root = shared_by_belief() * by_shared;
  const Eigen::MatrixXd covariance = root * root.transpose();
  const auto is_held = [](int i) { return i < kRigNumbers || i >= kLatency; };
  for (int i = 0; i < kSharedNumbers; ++i) {
    if (is_held(i)) model.sigma[i] = std::sqrt(covariance(i, i));
  }
  for (int i = 0; i < kSharedNumbers; ++i) {
    for (int k = 0; k < kSharedNumbers; ++k) {
      if (!is_held(i) || !is_held(k) || model.sigma[i] == 0 || model.sigma[k] == 0) continue;
      model.held_covariance(i, k) = covariance(i, k) / model.sigma[i] / model.sigma[k];
    }
  }
  for (const Side side : {Side::kLower, Side::kUpper}) {
    const bool is_bent = model.sigma[rig_number(side, kK1)] > 0 || model.sigma[rig_number(side, kK2)] > 0;
    model.views[std::size_t(side)].has_lens = model.views[std::size_t(side)].has_lens || is_bent;
  }
}

}  // namespace

SharedModel::SharedModel(const CalibrationProblem& problem) {
  take_view(*this, problem.rig.lower, Side::kLower, problem);
  take_view(*this, problem.rig.upper, Side::kUpper, problem);
  for (const int relative : {kAzimuth, kOffsetX, kOffsetY}) {
    mean[rig_number(Side::kUpper, relative)] -= mean[rig_number(Side::kLower, relative)];
  }
  mean[kLensHeight] = problem.rig.lower.settings().lens_height_m;
  mean[kSeparation] = problem.rig.mirror_separation_m();
  sigma[kLensHeight] = problem.priors.lens_height_m;
  sigma[kSeparation] = problem.priors.mirror_separation_m;
  take_times(*this, problem);
  if (problem.wheels) {
    has_wheels = true;
    wheels = *problem.wheels;
    mean[kWheelRadius] = wheels.radius_m;
    sigma[kWheelRadius] = problem.priors.wheel_radius_share * wheels.radius_m;
    mean[kWheelRatio] = 1;
    sigma[kWheelRatio] = problem.priors.wheel_ratio;
    mean[kWheelSeparation] = wheels.separation_m;
    sigma[kWheelSeparation] = problem.priors.wheel_separation_m;
  }
  if (problem.held_rig) hold(*this, *problem.held_rig);
  const auto is_of_lens = [](int i) { return i < kLensHeight && (i % kViewNumbers == kK1 || i % kViewNumbers == kK2); };
  for (int i = 0; i < kSharedNumbers; ++i) {
    const bool is_held = problem.held_rig && (i < kRigNumbers || i >= kLatency);
    if (sigma[i] == 0 || is_held || (is_of_lens(i) && !problem.fit_distortion)) fixed.push_back(i);
  }
}

MirrorView to_view(const SharedModel& model, const Shared& numbers, const MirrorViewSettings& like, Side side) {
  const ViewNumbers<double> n = view_numbers(numbers.data(), side);
  MirrorViewSettings settings = like;
  settings.centre_px = {n.column, n.row};
  settings.rim_radius_px = n.rim_px;
  // The solver knows no turns.
  settings.azimuth_rad = base::wrap_angle_rad(n.azimuth);
  settings.tilt_rad = {n.tilt_x, n.tilt_y};
  settings.axis_offset_m = {n.offset_x, n.offset_y};
  settings.cone = {.apex_rad = n.apex, .rim_radius_m = n.mirror_radius, .lens_to_tip_m = n.lens_to_tip};
  settings.lens_height_m = n.lens_height;
  const ViewConstants& constants = model.views[side == Side::kLower ? 0 : 1];
  if (constants.has_lens && (like.distortion || n.k1 != 0 || n.k2 != 0)) {
    LensDistortion lens{{n.k1, n.k2}, constants.focal_px, constants.principal_px};
    lens.coefficients.insert(lens.coefficients.end(), constants.further.begin(),
                             constants.further.begin() + std::ptrdiff_t(constants.lens_terms - 2));
    settings.distortion = lens;
  }
  return MirrorView(settings);
}

std::array<ExposureTimes, 2> to_exposures(const Shared& numbers) {
  return {ExposureTimes{0 - numbers[kLatency], numbers[kLowerReadout]},
          ExposureTimes{numbers[kSkew] - numbers[kLatency], numbers[kUpperReadout]}};
}

std::string name_of(int shared_number) {
  if (shared_number >= kRigNumbers) return kOtherNames[std::size_t(shared_number - kRigNumbers)];
  if (shared_number == rig_number(Side::kUpper, kAzimuth)) return "upper.azimuth_minus_lower_rad";
  if (shared_number == rig_number(Side::kUpper, kOffsetX)) return "upper.axis_offset_minus_lower_m.x";
  if (shared_number == rig_number(Side::kUpper, kOffsetY)) return "upper.axis_offset_minus_lower_m.y";
  return rig_number_name(shared_number);
}

Eigen::Vector2d residual_px(const BundleData& data, const SightingRow& row, const BundleState& state) {
  Eigen::Vector2d residual;
  sighting_residual(data.model, row, state.unknowns.data(), state.poses[row.frame].data(),
                    state.landmarks[row.landmark_index].data(), residual.data());
  return residual;
}

double wheel_chi_squared(const BundleData& data, const BundleState& state) {
  double sum = 0;
  const Eigen::Vector2d none = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < data.wheels.size(); ++i) {
    const WheelRow& row = data.wheels[i];
    Eigen::Matrix<double, 5, 1> residual;
    wheel_residual(data.model, row, state.unknowns.data(), state.poses[row.frame - 1].data(),
                   state.poses[row.frame].data(), row.follows ? state.slips[i - 1].data() : none.data(),
                   state.slips[i].data(), residual.data());
    sum += residual.squaredNorm();
  }
  return sum;
}

}  // namespace twocone::vision::calibration

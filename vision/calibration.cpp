// SPDX-License-Identifier: Apache-2.0
#include "vision/calibration.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/quantile.h"
#include "vision/calibration/bundle.h"

namespace twocone::vision {

using namespace calibration;  // NOLINT(google-build-using-namespace): the parts of which this file is the interface

std::string_view to_string(CalibrationVerdict verdict) {
  constexpr std::array<std::string_view, 5> kNames{"ok", "no_solver", "too_few_frames", "too_few_landmarks",
                                                   "contradictory"};
  static_assert(std::size_t(CalibrationVerdict::kContradictory) + 1 == kNames.size());
  return kNames.at(std::size_t(verdict));
}

bool can_calibrate() { return has_solver(); }

namespace {

// Cauchy's loss is 95 % efficient for a Gaussian at this many sigmas.
constexpr double kCauchySigmas = 2.385;
// The median length of a whitened pixel error of two Gaussian coordinates: sqrt(2 ln 2).
constexpr double kMedianLength = 1.1774100225154747;
constexpr int kRobustRounds = 8;
constexpr int kScaleRounds = 4;
constexpr double kMostOutliers = 1.0 / 3;
// Sightings are accurate to a fraction of a pixel, and no rig is this many sigmas from its prior. Beyond either limit
// the map, the names or the views differ from those of the problem. Times may be: cameras deliver images much later
// than anybody expects.
constexpr double kMostScatter_px = 2;
constexpr double kMostPriorSigmas = 6;

std::vector<double> whitened_lengths(const BundleData& data, const BundleState& state) {
  std::vector<double> lengths;
  for (const SightingRow& row : data.sightings)
    lengths.push_back((row.whitener * residual_px(data, row, state)).norm());
  return lengths;
}

/// Computes the scatter of the sightings over their sigma, by the median of all, which outliers hardly change.
double robust_scale(const BundleData& data, const BundleState& state) {
  return std::max(base::median(whitened_lengths(data, state)) / kMedianLength, 1e-6);
}

/// Minimises Cauchy's loss. Its scale is that of the residuals, which shrink as the answer gets better.
bool minimise_robustly(const BundleData& data, BundleSettings settings, BundleState& state) {
  double last = 0;
  for (int round = 0; round < kRobustRounds; ++round) {
    settings.sighting_scale = robust_scale(data, state);
    if (round > 0 && std::abs(settings.sighting_scale - last) < 0.01 * last) return true;
    last = settings.sighting_scale;
    settings.cauchy_sigmas = kCauchySigmas;
    if (!minimise(data, settings, state)) return false;
  }
  return true;
}

double rms_px(const std::vector<SightingResidual>& residuals, const BundleData& data, Side side,
              Eigen::Vector2d SightingResidual::*which) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (data.sightings[i].side != side || residuals[i].outlier) continue;
    sum += (residuals[i].*which).squaredNorm();
    count += 2;
  }
  return count == 0 ? 0 : std::sqrt(sum / double(count));
}

/// As rms_px() of the residuals, weighted by what the sightings state: those of blurred tops may be off by many pixels.
double weighted_rms_px(const BundleData& data, const BundleState& state, Side side) {
  double sum = 0;
  double weight = 0;
  for (const SightingRow& row : data.sightings) {
    if (row.side != side || !row.used) continue;
    sum += (row.whitener * residual_px(data, row, state)).squaredNorm();
    weight += row.whitener.squaredNorm();
  }
  return weight == 0 ? 0 : std::sqrt(sum / weight);
}

Eigen::Vector2d unbiased_residual_px(const BundleData& data, const SightingRow& row, const BundleState& state) {
  return residual_px(data, row, state) -
         row.axes * (state.biases[row.groups[0]] + state.biases[row.groups[1]] + state.biases[row.groups[2]]);
}

/// Computes the square root of the reduced chi-squared of the sightings. The poses are counted against them, because
/// they determine the poses almost alone; the slips are counted against the wheels.
double scatter(const BundleData& data, const BundleState& state, std::size_t observed) {
  double sum = 0;
  double count = 0;
  for (const SightingRow& row : data.sightings) {
    if (!row.used) continue;
    sum += (row.whitener * unbiased_residual_px(data, row, state)).squaredNorm();
    count += 2;
  }
  const double freedom = count - 3 * double(state.poses.size()) - double(observed);
  return freedom > 0 ? std::sqrt(sum / freedom) : 1;
}

double wheel_scatter(const BundleData& data, const BundleState& state) {
  return std::sqrt(wheel_chi_squared(data, state) / (3 * double(data.wheels.size())));
}

/// Computes the standard deviation of the error that sightings share, from the means of the smallest groups minus the
/// part that their scatter causes (DerSimonian & Laird's method, unweighted). The larger groups get the same value,
/// which is too large rather than too small. Not below `least_px`.
double systematic_px(const BundleData& data, const BundleState& state, double least_px) {
  struct Sums {
    Eigen::Array2d first = Eigen::Array2d::Zero();
    Eigen::Array2d second = Eigen::Array2d::Zero();
    double count = 0;
  };
  std::vector<Sums> groups(data.groups);
  for (const SightingRow& row : data.sightings) {
    if (!row.used) continue;
    const Eigen::Array2d along = (row.axes.transpose() * residual_px(data, row, state)).array();
    Sums& sums = groups[row.groups[2]];
    sums.first += along;
    sums.second += along * along;
    sums.count += 1;
  }
  double sum = 0;
  double count = 0;
  for (const Sums& g : groups) {
    if (g.count < 3) continue;
    const Eigen::Array2d mean = g.first / g.count;
    const Eigen::Array2d variance = (g.second / g.count - mean * mean) * g.count / (g.count - 1);
    sum += (mean * mean - variance / g.count).sum();
    count += 2;
  }
  return count == 0 ? least_px : std::max(least_px, std::sqrt(std::max(0.0, sum / count)));
}

/// Marks the sightings beyond kOutlierSigmas of the scatter.
std::size_t mark_outliers(BundleData& data, const BundleState& state, double scale) {
  const std::vector<double> lengths = whitened_lengths(data, state);
  std::size_t outliers = 0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    data.sightings[i].used = lengths[i] <= kOutlierSigmas * scale;
    outliers += data.sightings[i].used ? 0 : 1;
  }
  return outliers;
}

/// Returns `problem` without the sightings of frames that have fewer than two landmarks left, since these determine no
/// pose; nothing if there are no such frames.
std::optional<CalibrationProblem> without_lost_frames(const CalibrationProblem& problem, const Bundle& bundle) {
  std::vector<std::vector<LandmarkSighting>> left(problem.frames.size());
  std::vector<bool> kept(problem.frames.size(), false);
  for (std::size_t i = 0; i < bundle.origins.size(); ++i) {
    const SightingResidual& origin = bundle.origins[i];
    kept[origin.frame] = true;
    if (bundle.data.sightings[i].used)
      left[origin.frame].push_back(problem.frames[origin.frame].sightings[origin.sighting]);
  }
  std::optional<CalibrationProblem> fewer;
  for (std::size_t i = 0; i < left.size(); ++i) {
    if (!kept[i] || show_two_landmarks(left[i], &LandmarkSighting::landmark)) continue;
    if (!fewer) fewer = problem;
    fewer->frames[i].sightings.clear();
  }
  return fewer;
}

}  // namespace

CalibrationResult calibrate(const CalibrationProblem& problem) {
  check(problem);
  CalibrationResult result;
  const auto refused = [&result](CalibrationVerdict verdict) {
    result.verdict = verdict;
    return result;
  };
  if (!has_solver()) return refused(CalibrationVerdict::kNoSolver);
  std::vector<LandmarkSighting> all;
  for (const CalibrationFrame& frame : problem.frames)
    all.insert(all.end(), frame.sightings.begin(), frame.sightings.end());
  if (!all.empty() && !show_two_landmarks(all, &LandmarkSighting::landmark)) {
    return refused(CalibrationVerdict::kTooFewLandmarks);
  }
  Bundle bundle = bundle_of(problem);
  BundleData& data = bundle.data;
  result.frames_used = bundle.start.poses.size();
  result.frames_dropped = problem.frames.size() - result.frames_used;
  if (result.frames_used < CalibrationResult::kMinFrames) return refused(CalibrationVerdict::kTooFewFrames);
  result.verdict = CalibrationVerdict::kContradictory;

  BundleState state = bundle.start;
  BundleSettings settings;
  settings.hold_all = true;
  if (!minimise_robustly(data, settings, state)) return result;
  result.residuals = bundle.origins;
  for (std::size_t i = 0; i < data.sightings.size(); ++i) {
    result.residuals[i].before_px = residual_px(data, data.sightings[i], state);
  }

  settings.hold_all = false;
  settings.held = data.model.fixed;
  if (!minimise_robustly(data, settings, state)) return result;
  // Sightings within what they state are no outliers, however well the others agree.
  settings.sighting_scale = std::max(1.0, robust_scale(data, state));
  result.outliers = mark_outliers(data, state, settings.sighting_scale);
  if (double(result.outliers) > kMostOutliers * double(data.sightings.size())) return result;
  if (const auto fewer = without_lost_frames(problem, bundle)) return calibrate(*fewer);

  const std::vector<std::size_t> seen = seen_landmarks(data);
  const auto free_numbers = [&settings, &data, &seen] {
    return std::size_t(kSharedNumbers) - settings.held.size() + (data.moves_landmarks ? 2 * seen.size() : 0);
  };
  const auto settle = [&] {
    for (int round = 0; round < kScaleRounds; ++round) {
      if (!minimise(data, settings, state)) return false;
      result.sighting_scale = scatter(data, state, free_numbers());
      settings.sighting_scale = std::max(1.0, result.sighting_scale);
      if (!data.wheels.empty()) {
        result.wheel_scale = wheel_scatter(data, state);
        settings.wheel_scale = std::max(1.0, result.wheel_scale);
      }
      settings.systematic_px = systematic_px(data, state, problem.systematic_px);
    }
    return true;
  };
  if (!settle()) return result;
  settings.held = unobserved(shared_information(data, settings, state), data.model);
  for (const int i : settings.held) state.unknowns[i] = 0;
  if (!settle()) return result;
  const Eigen::MatrixXd covariance =
      consider_covariance(shared_information(data, settings, state), settings.held, data.model.held_covariance);

  for (std::size_t i = 0; i < data.sightings.size(); ++i) {
    result.residuals[i].after_px = residual_px(data, data.sightings[i], state);
    result.residuals[i].outlier = !data.sightings[i].used;
  }
  for (const Side side : {Side::kLower, Side::kUpper}) {
    const std::size_t k = side == Side::kLower ? 0 : 1;
    result.rms_before_px[k] = rms_px(result.residuals, data, side, &SightingResidual::before_px);
    result.rms_after_px[k] = rms_px(result.residuals, data, side, &SightingResidual::after_px);
    result.sightings[k] = std::size_t(std::count_if(data.sightings.begin(), data.sightings.end(),
                                                    [side](const SightingRow& r) { return r.side == side && r.used; }));
  }
  const auto scatter_px = [&](Side side) { return weighted_rms_px(data, state, side); };
  if (std::max(scatter_px(Side::kLower), scatter_px(Side::kUpper)) > kMostScatter_px) return result;
  if (state.unknowns.head<kLatency>().cwiseAbs().maxCoeff() > kMostPriorSigmas) return result;
  result.systematic_px = settings.systematic_px;
  take_parameters(data.model, state.unknowns, covariance, settings.held, result);
  if (data.moves_landmarks) take_landmark_shifts(problem.landmarks, state, covariance, seen, result);
  take_belief(data.model, problem.landmarks, state, covariance, result);
  result.poses.resize(problem.frames.size());
  for (std::size_t i = 0; i < bundle.frames.size(); ++i) result.poses[bundle.frames[i]] = state.poses[i];
  const Shared numbers = data.model.numbers(state.unknowns);
  try {
    result.rig = Rig{to_view(data.model, numbers, problem.rig.lower.settings(), Side::kLower),
                     to_view(data.model, numbers, problem.rig.upper.settings(), Side::kUpper), to_exposures(numbers)};
  } catch (const std::invalid_argument&) {
    return result;  // parameters outside the domain of a rig
  }
  if (problem.wheels) {
    result.wheels = problem.wheels;
    result.wheels->radius_m = numbers[kWheelRadius];
    result.wheels->separation_m = numbers[kWheelSeparation];
  }
  result.verdict = CalibrationVerdict::kOk;
  return result;
}

}  // namespace twocone::vision

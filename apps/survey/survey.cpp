// SPDX-License-Identifier: Apache-2.0
#include "apps/survey/survey.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/calibrate/start.h"
#include "apps/config/to_layers.h"
#include "apps/survey/bearing_map.h"
#include "apps/survey/rough_map.h"
#include "apps/survey/widths.h"
#include "base/errors.h"
#include "localisation/odometry.h"
#include "vision/landmark_search.h"
#include "vision/uncertain_rig.h"

namespace twocone::survey {
namespace {

constexpr int kMostRounds = 10;
/// The rounds end when no landmark moves by more within the map, and no top and radius changes by more; a radius that
/// is known less well, by a share of its sigma.
constexpr double kSettled_m = 5e-4;
constexpr double kSettledSigmas = 0.25;

// The first pose defines the world, so that it is exact: in numbers, to this many metres and radians.
constexpr double kExact = 1e-6;
// Priors of what a rough map has. They are wide, so that only the data count.
constexpr double kPlaceSigma_m = 1;
constexpr double kTopSigma_m = 0.3;
// What sightings are measured with in the first round: the errors of a map by bearings, and of a rough map.
constexpr LandmarkSigma kByBearings{.x_m = 0.4, .y_m = 0.4, .top_m = 0.2, .radius_m = 0.04};
constexpr LandmarkSigma kRough{.x_m = 0.1, .y_m = 0.1, .top_m = 0.03, .radius_m = 0.005};
// Two things of one hue that are nearer to each other than this are one.
constexpr double kOnePlace_m = 0.3;
// How well some rounds know a rig: the errors that a rough map allows for.
constexpr config::RigSigma kFoundSigma{.mirror_radius_m = 0.001,
                                       .lens_to_tip_m = 0.001,
                                       .mirror_separation_m = 0.003,
                                       .lens_height_m = 0.003,
                                       .apex_rad = 0.002,
                                       .centre_px = 1,
                                       .rim_radius_px = 1,
                                       .azimuth_rad = 0.01,
                                       .tilt_rad = 0.004,
                                       .axis_offset_m = 0.002,
                                       .late_s = 0.005,
                                       .readout_s = 0.005,
                                       .distortion = 0.01};
constexpr std::size_t kLeastOutlines = 6;  ///< one frame has two

/// Returns the frames that a survey uses. The first of a run is none of them: whether the robot moved while it was
/// exposed is not known.
calibrate::ChosenFrames frames_of(const std::vector<runlog::RunData>& runs, int count) {
  return calibrate::choose_frames(runs, count, 1);
}

/// Returns where a body is that was at `pose` a time ago, which may be negative.
Eigen::Vector3d pose_at(const Pose2& pose, const BodyTwist& twist, double time_s) {
  const double way_m = twist.forward_mps * time_s;
  const double turn_rad = twist.turn_radps * time_s;
  const Pose2 there = localisation::drive_arc(pose, way_m - turn_rad / 2, way_m + turn_rad / 2, 1);
  return {there.x_m, there.y_m, there.heading_rad};
}

/// Returns the runs with these landmarks on their maps.
std::vector<runlog::RunData> with_landmarks(const std::vector<runlog::RunData>& runs,
                                            const std::vector<Landmark>& landmarks) {
  std::vector<runlog::RunData> on_map = runs;
  for (runlog::RunData& run : on_map) {
    run.map.landmarks = landmarks;
    run.map.without_sigma.clear();
  }
  return on_map;
}

Error no_solver() {
  return {ErrorCode::kUnavailable,
          "this twocone was built without Ceres, which surveys: apt install libceres-dev, then configure again"};
}

Error refusal(const vision::CalibrationResult& result, const std::string& run) {
  using vision::CalibrationVerdict;
  switch (result.verdict) {
    case CalibrationVerdict::kNoSolver:
      return no_solver();
    case CalibrationVerdict::kTooFewFrames:
    case CalibrationVerdict::kTooFewLandmarks:
      return Error(ErrorCode::kBadData,
                   "{}: only {} of the chosen frames show two landmarks or more, a survey needs {}", run,
                   result.frames_used, vision::CalibrationResult::kMinFrames);
    case CalibrationVerdict::kContradictory:
    case CalibrationVerdict::kOk:
      break;
  }
  return Error(ErrorCode::kBadData,
               "{}: no map explains what is seen with this rig: calibrate it, or survey with --calibrate", run);
}

/// Returns whether a round changed nothing but place, direction and scale of the whole map, which the sightings
/// determine much less than its shape.
bool is_settled(const std::vector<Landmark>& last, const std::vector<Landmark>& now) {
  const auto count = double(now.size());
  Eigen::Vector2d last_middle = Eigen::Vector2d::Zero();
  Eigen::Vector2d now_middle = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < now.size(); ++i) {
    last_middle += vision::place_m(last[i]) / count;
    now_middle += vision::place_m(now[i]) / count;
  }
  // The similarity as a complex number: now = similarity times last.
  std::complex<double> product = 0;
  double square = 0;
  const auto arm = [](const Landmark& landmark, const Eigen::Vector2d& middle) {
    return std::complex<double>(landmark.x_m - middle.x(), landmark.y_m - middle.y());
  };
  for (std::size_t i = 0; i < now.size(); ++i) {
    product += std::conj(arm(last[i], last_middle)) * arm(now[i], now_middle);
    square += std::norm(arm(last[i], last_middle));
  }
  const std::complex<double> similarity = product / square;
  for (std::size_t i = 0; i < now.size(); ++i) {
    const auto moved = arm(now[i], now_middle) - similarity * arm(last[i], last_middle);
    if (std::abs(moved) > kSettled_m) return false;
    const double settled_m = std::max(kSettled_m, kSettledSigmas * now[i].sigma.radius_m);
    if (std::abs(now[i].radius_m - std::abs(similarity) * last[i].radius_m) > settled_m) return false;
    if (std::abs(now[i].top_m - last[i].top_m) > kSettled_m) return false;
  }
  return true;
}

/// Number of sightings of each landmark, and how many of them were left out.
std::vector<SurveyedLandmark> counted(const std::vector<Landmark>& landmarks, const vision::CalibrationProblem& problem,
                                      const vision::CalibrationResult& result) {
  std::vector<SurveyedLandmark> counts;
  counts.reserve(landmarks.size());
  for (const Landmark& landmark : landmarks) counts.push_back({landmark});
  for (const vision::SightingResidual& residual : result.residuals) {
    SurveyedLandmark& of = counts[problem.frames[residual.frame].sightings[residual.sighting].landmark];
    ++of.sightings;
    of.outliers += residual.outlier ? 1 : 0;
  }
  return counts;
}

/// Returns the first landmark that is none: the second of two of one hue at one place, one that hardly any frame shows,
/// or one whose sightings do not agree on a place. Says why.
std::optional<std::pair<std::size_t, std::string>> no_landmark(const std::vector<SurveyedLandmark>& landmarks) {
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const SurveyedLandmark& one = landmarks[i];
    for (const SurveyedLandmark& other : landmarks) {
      const bool is_twin = &other != &one && look_alike(other.landmark, one.landmark) &&
                           (vision::place_m(other.landmark) - vision::place_m(one.landmark)).norm() < kOnePlace_m;
      if (is_twin && (one.sightings < other.sightings || (one.sightings == other.sightings && &other < &one))) {
        return std::pair(i, fmt::format("{} is {}: they came to one place", one.landmark.name, other.landmark.name));
      }
    }
    if (one.sightings - one.outliers < kLeastOutlines) {
      return std::pair(i, fmt::format("{}: only {} of its outlines could be measured", one.landmark.name,
                                      one.sightings - one.outliers));
    }
    if (2 * one.outliers > one.sightings) {
      return std::pair(i,
                       fmt::format("{}: {} of its {} sightings contradict the others: it moved, or is several things",
                                   one.landmark.name, one.outliers, one.sightings));
    }
  }
  return std::nullopt;
}

/// Returns the distances with the indices of their landmarks. Error: kBadData for a name that was not found.
Result<std::vector<vision::MeasuredDistance>> distances_of(const std::vector<TapeDistance>& tapes,
                                                           const std::vector<Landmark>& landmarks) {
  std::vector<vision::MeasuredDistance> distances;
  for (const TapeDistance& tape : tapes) {
    std::array<std::size_t, 2> ends{};
    for (const auto& [end, name] : {std::pair(0U, &tape.from), std::pair(1U, &tape.to)}) {
      const auto found = std::ranges::find(landmarks, *name, &Landmark::name);
      if (found == landmarks.end()) {
        std::vector<std::string> names;
        names.reserve(landmarks.size());
        for (const Landmark& landmark : landmarks) names.push_back(landmark.name);
        return Error(ErrorCode::kBadData, "a distance names '{}', which the survey did not find; it found {}", *name,
                     fmt::join(names, ", "));
      }
      ends[end] = std::size_t(found - landmarks.begin());
    }
    if (ends[0] == ends[1]) return Error(ErrorCode::kBadData, "a distance is from '{}' to itself", tape.from);
    distances.push_back({ends[0], ends[1], tape.distance_m, tape.sigma_m});
  }
  return distances;
}

/// Returns a name for a landmark that the measured map does not have.
std::string new_name(const Landmark& landmark, const std::vector<Landmark>& measured) {
  const auto is_taken = [&](const std::string& name) {
    return std::ranges::find(measured, name, &Landmark::name) != measured.end();
  };
  std::string looks = vision::looks_of(landmark);
  if (landmark.bands) return looks;
  for (int number = 1;; ++number) {
    std::string name = fmt::format("{}.{}", looks, number);
    if (!is_taken(name)) return name;
  }
}

/// Lays the survey onto a measured map, and solves it again with what that map states.
std::optional<Error> refine(const std::vector<Landmark>& measured, const config::Robot& robot, const std::string& run,
                            Report& report) {
  calibrate::Report& solution = report.solution;
  std::vector<Landmark> surveyed;
  for (const SurveyedLandmark& l : report.landmarks) surveyed.push_back(l.landmark);
  const auto count = Eigen::Index(surveyed.size());
  Eigen::MatrixXd covariance(2 * count, 2 * count);
  const auto at = [](Eigen::Index landmark) { return vision::kRigNumbers + vision::kLandmarkNumbers * landmark; };
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index k = 0; k < count; ++k) {
      covariance.block<2, 2>(2 * i, 2 * k) = solution.result.belief_covariance.block<2, 2>(at(i), at(k));
    }
  }
  auto match = match_to_map(surveyed, covariance, measured);
  if (!match) return Error(match.error().code, "{}: {}", run, match.error().message);
  vision::CalibrationProblem& problem = solution.problem;
  problem.landmarks = match->landmarks;
  std::vector<Landmark> named = measured;
  for (std::size_t i = 0; i < surveyed.size(); ++i) {
    Landmark& landmark = problem.landmarks[i];
    LandmarkSigma& sigma = landmark.sigma;
    if (std::isinf(sigma.top_m)) {
      sigma.top_m = kTopSigma_m;
      sigma.radius_m = surveyed[i].sigma.radius_m;
      landmark.name = new_name(landmark, named);
      named.push_back(landmark);
    }
    if (std::isinf(sigma.x_m)) sigma.x_m = sigma.y_m = kPlaceSigma_m;
  }
  problem.first_pose_covariance.reset();
  problem.radii_follow_scale = false;
  for (std::size_t i = 0; i < problem.frames.size(); ++i) {
    std::optional<Eigen::Vector3d>& start = problem.frames[i].start;
    if (const auto& pose = solution.result.poses[i]) start = *pose;
    if (start) start = match->overlay.moved(Pose2{start->x(), start->y(), start->z()});
  }
  vision::CalibrationResult result = vision::calibrate(problem);
  if (result.verdict != vision::CalibrationVerdict::kOk) return refusal(result, run);
  if (report.calibrated) {
    calibrate::take(result, robot, solution);
  } else {
    solution.result = std::move(result);
  }
  report.landmarks = counted(calibrate::found_landmarks(solution.result), problem, solution.result);
  report.moved = std::move(match->moved);
  for (const std::string& name : match->missing) {
    report.left_out.push_back(fmt::format("{} was not found, and is not on the refined map", name));
  }
  return std::nullopt;
}

/// Where the rounds of sighting and solving start.
struct RoundsStart {
  RoughMap rough;
  /// The rig to measure with in the first round; empty: the believed one.
  std::optional<vision::Rig> rig;
  /// Landmarks are not expected at their places in the first round: their hues alone identify them.
  bool by_hue = false;
  int most_rounds = kMostRounds;
};

/// Measures outlines and solves, in rounds, until the result settles.
Result<Report> solve(const std::vector<runlog::RunData>& runs, const config::Robot& robot, const Settings& settings,
                     RoundsStart start, const std::function<void(double)>& notify) {
  const std::string name = runs.front().folder.string();
  RoughMap& rough = start.rough;
  std::vector<Landmark> landmarks = rough.landmarks;
  for (Landmark& landmark : landmarks) landmark.sigma = start.by_hue ? kByBearings : kRough;
  std::vector<runlog::RunData> on_map = with_landmarks(runs, landmarks);
  calibrate::ChosenFrames chosen = frames_of(on_map, settings.frames);
  const vision::Rig rig = config::to_rig(robot);

  vision::CalibrationProblem problem{.rig = rig,
                                     .wheels = calibrate::wheels_of(robot),
                                     .landmarks = landmarks,
                                     .frames = {},
                                     .lower_rim = {},
                                     .upper_rim = {},
                                     .priors = settings.priors,
                                     .fit_timing = settings.calibrates,
                                     .height_px = {robot.lower.settings.height_px, robot.upper.settings.height_px},
                                     .first_pose_covariance = kExact * kExact * Eigen::Matrix3d::Identity(),
                                     // Radii hold the scale of a map by bearings, since little else does.
                                     .radii_follow_scale = !start.by_hue};
  if (!settings.calibrates) {
    problem.held_rig = errors_without_landmarks(robot, runs.front().map).vision;
  }
  const config::RigSigma believed = robot.rig.sigma.value_or(config::ruler_sigma(robot.rig));
  calibrate::Report solution{.runs = {},
                             .robot = robot.file.string(),
                             .problem = problem,
                             .before = rig,
                             .after = rig,
                             .rig = robot.rig,
                             .drive = robot.drive,
                             .slip = problem.wheels->slip,
                             .believed = believed,
                             .has_one_map = true};
  for (const runlog::RunData& run : runs) solution.runs.push_back(run.folder.string());
  if (settings.calibrates) {
    calibrate::measure_circles(chosen, rig, solution.circles);
    problem.lower_rim = solution.circles[0].rim;
    problem.upper_rim = solution.circles[1].rim;
    problem.distortion_sigma = believed.distortion;
  }
  if (start.rig) solution.after = *start.rig;
  std::vector<std::optional<Eigen::Vector3d>> poses = rough.poses;
  for (int round = 0; round < start.most_rounds; ++round) {
    std::vector<std::optional<Eigen::Vector3d>> expected = poses;
    if (start.by_hue && round == 0) std::ranges::fill(expected, std::nullopt);
    calibrate::Sighted sighted = calibrate::sight(on_map, chosen, solution.after, landmarks, robot, {}, expected,
                                                  [&](double done) { notify((round + done) / start.most_rounds); });
    if (!sighted.unreadable.empty()) return sighted.unreadable.front();
    poses.front() = pose_at(rough.first, rough.twist, solution.after.exposures.front().late_s);
    for (std::size_t i = 0; i < sighted.frames.size(); ++i) sighted.frames[i].start = poses[i];
    const std::vector<Landmark> before = landmarks;
    auto distances = distances_of(settings.distances, landmarks);
    if (!distances) return distances.error();
    problem.distances = *std::move(distances);
    remove_narrow(sighted.frames, landmarks);
    measure_radii(sighted.frames, landmarks);
    problem.frames = std::move(sighted.frames);
    problem.landmarks = landmarks;
    for (Landmark& landmark : problem.landmarks) {
      landmark.sigma = {kPlaceSigma_m, kPlaceSigma_m, kTopSigma_m, landmark.sigma.radius_m};
    }
    vision::CalibrationResult result = vision::calibrate(problem);
    if (result.verdict != vision::CalibrationVerdict::kOk) return refusal(result, name);
    solution.rounds = round + 1;
    if (const auto none = no_landmark(counted(landmarks, problem, result)); none && round + 1 < start.most_rounds) {
      rough.left_out.push_back(none->second);
      landmarks.erase(landmarks.begin() + std::ptrdiff_t(none->first));
      if (landmarks.size() < 2) return refusal({}, name);
      for (runlog::RunData& run : on_map) run.map.landmarks = landmarks;
      chosen = frames_of(on_map, settings.frames);
      continue;
    }
    landmarks = calibrate::found_landmarks(result);
    solution.is_settled = round > 0 && is_settled(before, landmarks);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (result.poses[i]) poses[i] = result.poses[i];
    }
    for (runlog::RunData& run : on_map) run.map.landmarks = landmarks;
    if (settings.calibrates) {
      calibrate::take(result, robot, solution);
    } else {
      solution.result = std::move(result);
    }
    if (solution.is_settled) break;
  }
  solution.problem = std::move(problem);
  std::vector<SurveyedLandmark> surveyed = counted(landmarks, solution.problem, solution.result);
  Report report{.landmarks = std::move(surveyed),
                .moved = {},
                .left_out = rough.left_out,
                .solution = std::move(solution),
                .calibrated = settings.calibrates,
                .bounds = runs.front().map.bounds};
  return report;
}

/// A robot whose rig was found in its images, and what to measure with until it is solved for.
struct FoundRig {
  config::Robot robot;               ///< with what the images show in place of what they contradict
  vision::CalibrationPriors priors;  ///< about that robot's rig
  std::optional<vision::Rig> rig;    ///< solved for, roughly
  config::Robot rough;               ///< with that rig
};

/// Returns whether so little is known of the rig that the two views would not agree on a landmark.
bool is_rough(const config::Robot& robot) {
  constexpr double kRoughCentre_px = 3;
  constexpr double kRoughAzimuth_rad = 0.1;
  constexpr double kRoughTilt_rad = 0.01;
  if (!robot.rig.calibration.empty()) return false;
  const config::RigSigma sigma = robot.rig.sigma.value_or(config::ruler_sigma(robot.rig));
  return !robot.rig.missing.empty() || sigma.centre_px > kRoughCentre_px || sigma.azimuth_rad > kRoughAzimuth_rad ||
         sigma.tilt_rad > kRoughTilt_rad;
}

/// Finds a rig that is known by a ruler: a map by bearings alone, what the images show on that map, and some rounds of
/// a survey with landmarks whose hues identify them.
Result<FoundRig> find_first_rig(const runlog::RunData& run, const config::Robot& robot, const Settings& settings,
                                const std::function<void(double)>& notify) {
  const int frames = std::min(120, settings.frames);
  constexpr int kRounds = 3;
  const std::vector<runlog::RunData> runs{run};
  auto rough = find_bearing_map(run, frames_of(runs, frames), robot);
  if (!rough) return rough.error();
  std::vector<Landmark> landmarks = rough->landmarks;
  for (Landmark& landmark : landmarks) landmark.sigma = kByBearings;
  const std::vector<runlog::RunData> on_map = with_landmarks(runs, landmarks);
  calibrate::Settings search;
  search.priors = settings.priors;
  const auto start = calibrate::find_start(on_map.front(), robot, search);
  if (!start) return start.error();
  if (start->exchanged) {
    return Error(ErrorCode::kBadData,
                 "{}: the images of camera lower are those of the upper mirror: exchange the two "
                 "cameras in the robot file, and record again",
                 run.folder.string());
  }
  Settings first = settings;
  first.priors = start->priors;
  first.distances.clear();
  first.frames = frames;
  FoundRig found{start->robot, start->priors, {}, start->robot};
  auto solved = solve(runs, start->robot, first, {*std::move(rough), {}, true, kRounds}, notify);
  if (!solved) return solved.error();
  found.rig = solved->solution.after;
  found.rough.rig = solved->solution.rig;
  found.rough.rig.sigma = kFoundSigma;
  found.rough.drive = solved->solution.drive;
  return found;
}

}  // namespace

Result<Report> survey(const std::vector<runlog::RunData>& runs, const config::Robot& robot, const Settings& settings) {
  if (runs.empty()) throw std::invalid_argument("survey: there is no run, must be at least one");
  if (!vision::can_calibrate()) return no_solver();
  // Shares of the progress.
  const bool finds_rig = settings.calibrates && is_rough(robot);
  const double first = finds_rig ? 0.4 : 0;
  const auto notify = [&](double from, double to) {
    return [&settings, from, to](double done) {
      if (settings.progress) settings.progress(from + (to - from) * done);
    };
  };
  FoundRig found{robot, settings.priors, {}, robot};
  if (finds_rig) {
    auto first_rig = find_first_rig(runs.front(), robot, settings, notify(0, first));
    if (!first_rig) return first_rig.error();
    found = *std::move(first_rig);
  }
  auto rough = find_rough_map(runs, frames_of(runs, settings.frames), found.rough);
  if (!rough) return rough.error();
  Settings all = settings;
  all.priors = found.priors;
  auto solved = solve(runs, found.robot, all, {*std::move(rough), found.rig}, notify(first, 1));
  if (!solved) return solved.error();
  Report report = *std::move(solved);
  if (!settings.measured.empty()) {
    if (const auto failed = refine(settings.measured, found.robot, runs.front().folder.string(), report)) {
      return *failed;
    }
  }
  notify(0, 1)(1);
  return report;
}

}  // namespace twocone::survey

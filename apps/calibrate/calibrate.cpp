// SPDX-License-Identifier: Apache-2.0
#include "apps/calibrate/calibrate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "apps/calibrate/start.h"
#include "apps/config/calibration_file.h"
#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/image_file.h"
#include "base/errors.h"
#include "localisation/odometry.h"
#include "vision/outline_ranging.h"

namespace twocone::calibrate {
namespace {

// A sighting depends slightly on the rig with which it is measured: a fifth of an error of the rig, or less, remains
// after a round. The rounds end when no number moves by more than kSettled of its sigma, at the latest after
// kMostRounds.
constexpr int kMostRounds = 14;
constexpr int kFullRounds = 4;  ///< at the least, of those with all frames
constexpr double kSettled = 0.3;
// The first rounds use a third of the frames, if these are enough, until no number moves by more than kRoughlySettled
// of its sigma there.
constexpr int kRoughShare = 3;
constexpr int kFewestRoughFrames = 20;
constexpr double kRoughlySettled = 1;

std::optional<Error> refusal(const std::vector<runlog::RunData>& runs, const config::Robot& robot) {
  for (const runlog::RunData& run : runs) {
    const auto same = [](const auto& a, const auto& b) {
      return a.settings.width_px == b.settings.width_px && a.settings.height_px == b.settings.height_px;
    };
    if (!same(run.robot.lower, robot.lower) || !same(run.robot.upper, robot.upper)) {
      return Error(ErrorCode::kBadData, "{} has images of another size than {} says", run.folder.string(),
                   robot.file.string());
    }
    if (run.frames.size() < vision::CalibrationResult::kMinFrames) {
      return Error(ErrorCode::kBadData, "{} has {} frames, a calibration needs {} or more", run.folder.string(),
                   run.frames.size(), vision::CalibrationResult::kMinFrames);
    }
    if (const std::size_t count = run.map.landmarks.size(); count < 2) {
      return Error(ErrorCode::kBadData, "{}: {} of {} landmarks have a height (top_m), a calibration needs two or more",
                   run.map.file.string(), count, count);
    }
  }
  return std::nullopt;
}

/// Returns the one-line error for a verdict without an answer.
Error refusal(const vision::CalibrationResult& result, const std::string& runs) {
  using vision::CalibrationVerdict;
  switch (result.verdict) {
    case CalibrationVerdict::kNoSolver:
      return {ErrorCode::kUnavailable,
              "this twocone was built without Ceres, which calibrates: apt install libceres-dev, then configure again"};
    case CalibrationVerdict::kTooFewFrames:
      return Error(ErrorCode::kBadData,
                   "{}: only {} of the chosen frames show two landmarks or more, a calibration needs {}", runs,
                   result.frames_used, vision::CalibrationResult::kMinFrames);
    case CalibrationVerdict::kTooFewLandmarks:
      return Error(ErrorCode::kBadData, "{}: fewer than two landmarks are seen, a calibration needs two or more", runs);
    case CalibrationVerdict::kContradictory:
    case CalibrationVerdict::kOk:
      break;
  }
  return Error(ErrorCode::kBadData,
               "{}: no rig near the believed one explains what is seen: do the map's places, heights and colours "
               "belong to this room?",
               runs);
}

constexpr int kCircleImages = 31;

std::vector<vision::WheelReading> readings_between(const runlog::RunData& run, std::size_t from, std::size_t to) {
  std::vector<vision::WheelReading> readings;
  if (to >= run.drive.size()) return readings;  // the run was cut off before the wheels were written
  for (std::size_t i = from; i <= to; ++i) {
    readings.push_back({run.drive[i].t_s, run.drive[i].left_rad, run.drive[i].right_rad});
  }
  return readings;
}

/// Returns the files of a frame's images, those of the lower mirror first.
std::array<std::filesystem::path, 2> image_files(const runlog::RunData& run, std::size_t row, bool exchanged) {
  auto files = runlog::images_of(run, row);
  if (exchanged) std::swap(files[0], files[1]);
  return files;
}

/// Returns whether the sightings belong to the landmark. Under a wrong rig, ranges may fail although sightings are
/// right.
bool is_trusted(vision::RangeVerdict verdict) {
  using vision::RangeVerdict;
  return verdict == RangeVerdict::kOk || verdict == RangeVerdict::kOneView || verdict == RangeVerdict::kInconsistent ||
         verdict == RangeVerdict::kBeyondLimit;
}

}  // namespace

Sighted sight(const std::vector<runlog::RunData>& runs, const ChosenFrames& chosen, const vision::Rig& rig,
              const std::vector<Landmark>& landmarks, const config::Robot& robot,
              const std::optional<vision::BeliefErrors>& found,
              const std::vector<std::optional<Eigen::Vector3d>>& poses, const std::function<void(double)>& progress) {
  Sighted sighted;
  for (const runlog::RunData& run : runs) {
    const drivers::CameraPart& lower_camera = chosen.exchanged ? run.robot.upper : run.robot.lower;
    const drivers::CameraPart& upper_camera = chosen.exchanged ? run.robot.lower : run.robot.upper;
    auto targets = config::to_targets(run.map);
    const auto of_run = std::ranges::find(chosen.frames, &run, &ChosenFrames::Frame::run);
    if (of_run == chosen.frames.end()) continue;
    for (std::size_t i = 0; i < targets.size(); ++i) {
      targets[i].top_m = landmarks[of_run->first_landmark + i].top_m;
      targets[i].radius_m = landmarks[of_run->first_landmark + i].radius_m;
    }
    vision::BeliefErrors errors = found ? *found : config::to_belief_errors(robot, run.map).vision;
    if (found) {
      const auto first = found->landmarks.begin() + std::ptrdiff_t(of_run->first_landmark);
      errors.landmarks.assign(first, first + std::ptrdiff_t(targets.size()));
    }
    std::optional<vision::OutlineRanging> ranging;
    try {
      ranging.emplace(rig, targets, size_of(lower_camera), size_of(upper_camera), std::vector<std::size_t>(), errors);
    } catch (const std::invalid_argument& error) {
      throw config::FileError("{}: {}", run.map.file.string(), error.what());
    }
    for (std::size_t index = 0; index < chosen.frames.size(); ++index) {
      const ChosenFrames::Frame& frame = chosen.frames[index];
      if (frame.run != &run) continue;
      const runlog::FrameRow& stamps = run.frames[frame.row];
      vision::CalibrationFrame& out = sighted.frames.emplace_back();
      out.wheels = frame.wheels;
      out.twist = runlog::twist_at(run, frame.row);
      const auto [lower_file, upper_file] = image_files(run, frame.row, chosen.exchanged);
      const auto lower = runlog::read_rgb(lower_file, lower_camera.settings);
      const auto upper = runlog::read_rgb(upper_file, upper_camera.settings);
      if (!lower || !upper) {
        sighted.unreadable.push_back(lower ? upper.error() : lower.error());
        continue;
      }
      const auto& [lower_t_s, upper_t_s] = chosen.exchanged ? std::pair(stamps.upper_t_s, stamps.lower_t_s)
                                                            : std::pair(stamps.lower_t_s, stamps.upper_t_s);
      const auto motion = vision::frame_motion(out.twist, upper_t_s - lower_t_s);
      vision::ExpectedPlaces expected;
      if (index < poses.size() && poses[index]) {
        const Pose2 pose{poses[index]->x(), poses[index]->y(), poses[index]->z()};
        for (std::size_t i = 0; i < targets.size(); ++i) {
          expected.emplace_back(localisation::in_body(pose, vision::place_m(landmarks[frame.first_landmark + i])));
        }
      }
      const auto measurements = ranging->measure(*lower, *upper, motion, expected);
      for (std::size_t i = 0; i < measurements.size(); ++i) {
        if (!is_trusted(measurements[i].verdict)) continue;
        const auto add = [&](vision::Side side, const std::optional<vision::Sighting>& sighting, double stamped_s) {
          if (!sighting) return;
          out.sightings.push_back({frame.first_landmark + i, side, *sighting, stamped_s - stamps.t_s});
        };
        add(vision::Side::kLower, measurements[i].lower_sighting, lower_t_s);
        add(vision::Side::kUpper, measurements[i].upper_sighting, upper_t_s);
      }
      progress(double(sighted.frames.size()) / double(chosen.frames.size()));
    }
  }
  return sighted;
}

namespace {

/// Returns about thirty images of one view from the chosen frames. Unreadable images are left out.
std::vector<cv::Mat> images_for_circles(const ChosenFrames& chosen, vision::Side side) {
  std::vector<cv::Mat> images;
  for (const std::size_t i : chosen_rows(chosen.frames.size(), kCircleImages)) {
    const ChosenFrames::Frame& frame = chosen.frames[i];
    auto rgb = runlog::read_rgb(image_files(*frame.run, frame.row, chosen.exchanged)[std::size_t(side)]);
    if (rgb && (images.empty() || rgb->size() == images.front().size())) images.push_back(std::move(*rgb));
  }
  return images;
}

}  // namespace

void measure_circles(const ChosenFrames& chosen, const vision::Rig& rig, std::array<ViewCircles, 2>& circles) {
  for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
    const auto& view = of_view(rig, side).settings();
    const auto images = images_for_circles(chosen, side);
    if (images.empty()) continue;
    ViewCircles& found = circles[std::size_t(side)];
    found.rim = vision::measure_rim(vision::median_image(images), {view.centre_px, view.rim_radius_px, 0});
    found.tip = vision::measure_tip(images, found.rim ? found.rim->centre_px : view.centre_px,
                                    vision::tip_reach_px(view.rim_radius_px));
  }
}

namespace {

config::RigView to_file(const vision::MirrorView& view, config::RigView like, const vision::MirrorView& before) {
  const vision::MirrorViewSettings& s = view.settings();
  like.apex_rad = s.cone.apex_rad;
  like.mirror_radius_m = s.cone.rim_radius_m;
  like.lens_to_tip_m = s.cone.lens_to_tip_m;
  like.centre_px = {s.centre_px.x(), s.centre_px.y()};
  like.rim_radius_px = s.rim_radius_px;
  like.azimuth_rad = s.azimuth_rad;
  like.tilt_rad = {s.tilt_rad.x(), s.tilt_rad.y()};
  like.axis_offset_m = {s.axis_offset_m.x(), s.axis_offset_m.y()};
  if (!s.distortion) return like;
  if (!before.settings().distortion || *before.settings().distortion != *s.distortion) {
    like.camera_info.clear();  // the numbers no longer come from that file
    like.distortion = s.distortion->coefficients;
  }
  // Without these two keys they would follow the centre and v, which have changed.
  like.distortion_focal_px = {s.distortion->focal_px.x(), s.distortion->focal_px.y()};
  like.distortion_principal_px = {s.distortion->principal_px.x(), s.distortion->principal_px.y()};
  return like;
}

bool is_settled(const std::vector<vision::CalibratedParameter>& last,
                const std::vector<vision::CalibratedParameter>& now, double sigmas) {
  return std::ranges::equal(
      last, now, [sigmas](const auto& a, const auto& b) { return std::abs(a.after - b.after) <= sigmas * b.sigma; });
}

void check(const std::vector<runlog::RunData>& runs, const Settings& settings) {
  if (runs.empty()) throw std::invalid_argument("calibrate: there is no run, must be at least one");
  if (settings.frames < int(vision::CalibrationResult::kMinFrames)) {
    throw base::InvalidArgument("calibrate: frames is {}, must be >= {}", settings.frames,
                                vision::CalibrationResult::kMinFrames);
  }
}

}  // namespace

std::vector<std::size_t> chosen_rows(std::size_t frames, int wanted) {
  const std::size_t count = std::min(frames, std::max(vision::CalibrationResult::kMinFrames, std::size_t(wanted)));
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < count; ++i) rows.push_back(count == 1 ? 0 : i * (frames - 1) / (count - 1));
  return rows;
}

ChosenFrames choose_frames(const std::vector<runlog::RunData>& runs, int count, std::size_t first) {
  std::size_t all = 0;
  for (const runlog::RunData& run : runs) all += run.frames.size();
  ChosenFrames chosen;
  for (const runlog::RunData& run : runs) {
    // Runs in one room share its landmarks, which may be elsewhere than their map says.
    const auto& own = run.map.landmarks;
    const auto same = std::search(chosen.landmarks.begin(), chosen.landmarks.end(), own.begin(), own.end());
    const auto first_landmark = std::size_t(same - chosen.landmarks.begin());
    if (same == chosen.landmarks.end()) chosen.landmarks.insert(chosen.landmarks.end(), own.begin(), own.end());
    const std::size_t available = run.frames.size() - std::min(first, run.frames.size());
    const std::size_t share = std::size_t(count) * available / std::max<std::size_t>(1, all);
    std::optional<std::size_t> last;
    for (const std::size_t chosen_row : chosen_rows(available, int(share))) {
      const std::size_t row = first + chosen_row;
      chosen.frames.push_back({&run, row, first_landmark, {}});
      if (last) chosen.frames.back().wheels = readings_between(run, *last, row);
      last = row;
    }
  }
  return chosen;
}

Result<Report> calibrate(const std::vector<runlog::RunData>& runs, const config::Robot& robot,
                         const Settings& settings) {
  check(runs, settings);
  std::vector<std::string> folders;
  folders.reserve(runs.size());
  for (const runlog::RunData& run : runs) folders.push_back(run.folder.string());
  const std::string names = fmt::format("{}", fmt::join(folders, ", "));
  if (!vision::can_calibrate()) {
    vision::CalibrationResult none;
    none.verdict = vision::CalibrationVerdict::kNoSolver;
    return refusal(none, names);
  }
  if (auto error = refusal(runs, robot)) return std::move(*error);
  const auto notify = [&settings](double done) {
    if (settings.progress) settings.progress(done);
  };

  auto found = find_start(runs.front(), robot, settings);
  if (!found) return found.error();
  const Start start = *std::move(found);
  const vision::Rig before = config::to_rig(start.robot);
  ChosenFrames chosen = choose_frames(runs, settings.frames);
  chosen.exchanged = start.exchanged;
  const vision::WheelBelief wheels = wheels_of(robot);
  const config::RigSigma believed = robot.rig.sigma.value_or(config::ruler_sigma(robot.rig));
  vision::CalibrationProblem problem{
      .rig = before,
      .wheels = wheels,
      .landmarks = chosen.landmarks,
      .frames = {},
      .lower_rim = {},
      .upper_rim = {},
      .priors = start.priors,
      .fit_distortion = settings.fit_distortion,
      .distortion_sigma = believed.distortion,
      .fit_timing = true,
      .height_px = {start.robot.lower.settings.height_px, start.robot.upper.settings.height_px}};
  Report report{.runs = folders,
                .robot = robot.file.string(),
                .problem = problem,
                .found = start.found,
                .replaced = start.replaced,
                .before = before,
                .after = before,
                .rig = start.robot.rig,
                .drive = robot.drive,
                .slip = wheels.slip,
                .believed = believed,
                .exchanged = start.exchanged,
                .has_one_map = chosen.landmarks.size() == runs.front().map.landmarks.size()};
  measure_circles(chosen, before, report.circles);
  problem.lower_rim = report.circles[0].rim;
  problem.upper_rim = report.circles[1].rim;
  constexpr double kCirclesShare = 0.1;
  notify(kCirclesShare);

  ChosenFrames rough = choose_frames(runs, settings.frames / kRoughShare);
  rough.exchanged = start.exchanged;
  bool is_rough = rough.frames.size() >= std::size_t(kFewestRoughFrames) && rough.frames.size() < chosen.frames.size();
  for (int round = 0; round < kMostRounds; ++round) {
    const auto part = [&](double done) { notify(kCirclesShare + (1 - kCirclesShare) * (round + done) / kMostRounds); };
    const auto& landmarks = report.result.landmarks.empty() ? problem.landmarks : report.result.landmarks;
    std::optional<vision::BeliefErrors> known;
    if (report.rounds > 0) {
      known = config::vision_errors(config::root_of(report.result.belief_covariance), report.result.landmarks.size(),
                                    report.result.systematic_px);
    }
    Sighted sighted = sight(runs, is_rough ? rough : chosen, report.after, landmarks, start.robot, known, {}, part);
    if (!sighted.unreadable.empty() && !settings.leave_out_unreadable) return sighted.unreadable.front();
    problem.frames = std::move(sighted.frames);
    const std::vector<vision::CalibratedParameter> last = std::move(report.result.parameters);
    report.result = vision::calibrate(problem);
    if (report.result.verdict != vision::CalibrationVerdict::kOk) {
      // What the images do not show is the cause, if there is such a thing.
      if (start.found && start.found->missing() != vision::NotFound::kNothing) {
        return Error(ErrorCode::kBadData, "{}: {}", runs.front().folder.string(),
                     estimation::what_to_change(*start.found));
      }
      return refusal(report.result, names);
    }
    report.after = *report.result.rig;
    report.rounds = round + 1;
    if (is_rough) {
      is_rough = round + kFullRounds < kMostRounds && !is_settled(last, report.result.parameters, kRoughlySettled);
      continue;
    }
    report.is_settled = is_settled(last, report.result.parameters, kSettled);
    if (report.is_settled) break;
  }
  notify(1);
  report.problem = std::move(problem);
  take(report.result, start.robot, report);
  return report;
}

vision::WheelBelief wheels_of(const config::Robot& robot) {
  // Slip and encoder keep their defaults, because `effects:` in the robot file is the simulation's truth, not a belief.
  return {.radius_m = robot.drive.wheel_radius_m, .separation_m = robot.drive.wheel_separation_m};
}

vision::CalibrationPriors priors_of(const config::Robot& robot) {
  vision::CalibrationPriors priors;
  const auto set = [](double stated, double& prior) {
    if (stated > 0) prior = stated;
  };
  const config::RigSigma ruler = config::ruler_sigma(robot.rig);
  double late_s = ruler.late_s;
  priors.readout_s = ruler.readout_s;
  if (const auto& s = robot.rig.sigma) {
    set(s->late_s, late_s);
    set(s->readout_s, priors.readout_s);
    set(std::max(s->mirror_radius_m, s->lens_to_tip_m), priors.length_m);
    set(s->mirror_separation_m, priors.mirror_separation_m);
    set(s->lens_height_m, priors.lens_height_m);
    set(s->centre_px, priors.centre_px);
    set(s->rim_radius_px / robot.rig.lower.rim_radius_px, priors.rim_share);
    set(s->azimuth_rad, priors.azimuth_rad);
    set(s->tilt_rad, priors.tilt_rad);
    set(s->axis_offset_m, priors.axis_offset_m);
    set(s->axis_offset_m, priors.lower_axis_offset_m);
    set(s->apex_rad, priors.apex_rad);
    set(s->distortion, priors.distortion);
  }
  priors.latency_s = late_s;
  priors.skew_s = std::numbers::sqrt2 * late_s;  // of two stamps
  if (const auto& s = robot.drive.sigma) {
    set(s->wheel_radius_m / robot.drive.wheel_radius_m, priors.wheel_radius_share);
    set(s->wheel_ratio, priors.wheel_ratio);
    set(s->wheel_separation_m, priors.wheel_separation_m);
  }
  return priors;
}

std::vector<Landmark> found_landmarks(const vision::CalibrationResult& result) {
  std::vector<Landmark> found = result.landmarks;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Eigen::Index at = vision::kRigNumbers + vision::kLandmarkNumbers * Eigen::Index(i);
    const Eigen::Vector4d sigma =
        result.belief_covariance.diagonal().segment<vision::kLandmarkNumbers>(at).cwiseMax(0).cwiseSqrt();
    found[i].sigma = {sigma[vision::kPlaceX], sigma[vision::kPlaceY], sigma[vision::kTop], sigma[vision::kRadius]};
  }
  return found;
}

std::vector<Landmark> refined_landmarks(const Report& report) {
  const auto is_exact = [](const Landmark& l) { return l.sigma == LandmarkSigma{}; };
  if (!report.has_one_map || std::ranges::all_of(report.result.landmarks, is_exact)) return {};
  return found_landmarks(report.result);
}

void take(const vision::CalibrationResult& result, const config::Robot& robot, Report& report) {
  report.result = result;
  report.after = *result.rig;
  for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
    config::RigView& view = of_view(report.rig, side);
    view = to_file(of_view(report.after, side), of_view(robot.rig, side), of_view(report.before, side));
    view.late_s = report.after.exposures[std::size_t(side)].late_s;
    view.readout_s = report.after.exposures[std::size_t(side)].readout_s;
  }
  report.rig.lens_height_m = report.after.lower.settings().lens_height_m;
  report.rig.mirror_separation_m = report.after.mirror_separation_m();
  report.drive.wheel_radius_m = result.wheels->radius_m;
  report.drive.wheel_separation_m = result.wheels->separation_m;
  // The uncertainties that the file states, or that an earlier calibration found, are those of other numbers.
  report.rig.sigma.reset();
  report.rig.calibration.clear();
  report.drive.sigma.reset();
}

}  // namespace twocone::calibrate

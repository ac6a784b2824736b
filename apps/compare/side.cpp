// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/side.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/compare/both_runs.h"
#include "apps/config/to_layers.h"
#include "apps/config/yaml/file_error.h"
#include "apps/estimation/method.h"
#include "apps/runlog/run_folder.h"
#include "apps/runlog/run_yaml.h"
#include "apps/runlog/tables/tables.h"

namespace twocone::compare {
namespace {

// Shorter runs give no meaningful rates, means and calibrations.
constexpr std::size_t kLeastFrames = vision::CalibrationResult::kMinFrames;

/// Returns the given trajectory at the frames' times; nothing where two of its poses are farther apart in time than
/// kLongestGap_s.
std::vector<std::optional<runlog::PoseRow>> at_times(const std::vector<runlog::FrameRow>& frames,
                                                     std::vector<runlog::PoseRow> poses) {
  constexpr double kLongestGap_s = 1.0;
  std::ranges::stable_sort(poses, {}, &runlog::PoseRow::t_s);
  std::vector<std::optional<runlog::PoseRow>> result;
  result.reserve(frames.size());
  for (const runlog::FrameRow& frame : frames) result.push_back(pose_at(poses, frame.t_s, kLongestGap_s));
  return result;
}

/// Returns the name of the folder with the results of method `outline`, as read_run() takes it.
std::string outline_method_of(const std::filesystem::path& folder, const runlog::RunInfo& info) {
  std::string outline(estimation::to_string(estimation::Method::kOutline));
  if (std::filesystem::exists(folder / "methods" / outline / "sightings.csv")) return outline;
  if (info.method == outline && std::filesystem::exists(folder / "sightings.csv")) return "";
  throw config::FileError(
      fmt::format("{}: has no sightings of method {}; make them with: twocone localise {} --method {}", folder.string(),
                  outline, folder.string(), outline));
}

/// Tests whether landmarks stand elsewhere than in the map. A second solution, which does not trust the map, decides
/// that; the first one, which does, determines everything else better. If some do, the rig is calibrated again with
/// their measured places.
void ask_the_map(Side& side) {
  calibrate::Report& report = *side.calibration;
  vision::CalibrationProblem doubting = report.problem;
  doubting.landmark_sigma_m = 0.02;  // prior standard deviation of a landmark's place about its place in the map
  const vision::CalibrationResult result = vision::calibrate(doubting);
  if (result.verdict != vision::CalibrationVerdict::kOk) return;
  // exp(-limit / 2): one landmark of a run in a hundred thousand.
  const double limit = -2 * std::log(1e-5);
  const auto shifts = vision::shifts_among(result, doubting.landmarks, limit);
  bool has_moved = false;
  for (const vision::RelativeShift& shift : shifts) {
    side.map_shifts.emplace(side.run.map.landmarks.at(shift.shift.landmark).name, shift);
    has_moved = has_moved || shift.moved;
    if (!shift.moved) continue;
    Landmark& landmark = doubting.landmarks[shift.shift.landmark];
    landmark.x_m += shift.shift.shift_m.x();
    landmark.y_m += shift.shift.shift_m.y();
  }
  if (!has_moved) return;
  doubting.landmark_sigma_m = 0;
  const vision::CalibrationResult again = vision::calibrate(doubting);
  if (again.verdict != vision::CalibrationVerdict::kOk) return;
  report.problem.landmarks = doubting.landmarks;
  calibrate::take(again, side.run.robot, report);
}

/// Leaves out the last frames if their images are incomplete: a recording that was cut off ends in such a frame. Where
/// more than kMost are broken, the cause is another one, and each is reported when it is read.
void drop_broken_end(Side& side) {
  constexpr int kMost = 2;
  runlog::RunData& run = side.run;
  for (int i = 0; i < kMost && !run.frames.empty(); ++i) {
    const std::uint64_t frame = run.frames.back().frame;
    const auto lower = runlog::read_image(runlog::lower_image_file(run.folder, frame));
    const auto upper = runlog::read_image(runlog::upper_image_file(run.folder, frame));
    if (lower && upper) return;
    side.left_out.push_back(
        fmt::format("frame {} is left out: {}", frame, lower ? upper.error().message : lower.error().message));
    run.frames.pop_back();
    const auto shorten = [&run](auto& rows) {
      if (rows.size() > run.frames.size()) rows.resize(run.frames.size());
    };
    shorten(run.drive);
    shorten(run.truth);
    shorten(run.odometry);
  }
}

}  // namespace

Result<Side> read_side(const std::filesystem::path& folder, const std::filesystem::path& poses) {
  if (std::filesystem::exists(folder / "run.yaml") && !std::filesystem::exists(folder / "frames.csv")) {
    return Error{ErrorCode::kBadData, fmt::format("{}: there is no frames.csv, so it has no frames", folder.string())};
  }
  const std::string method = outline_method_of(folder, runlog::read_run_yaml(folder).info);
  runlog::RunData run = runlog::read_run(folder, method, runlog::Tables::kFrames);
  const vision::Rig believed = config::to_rig(run.robot);
  Side side{.name = folder.string(), .run = std::move(run), .method = method, .believed = believed, .found = believed};
  const std::size_t rows = runlog::read_table<runlog::FrameRow>(folder / "frames.csv").size();
  if (rows > side.run.frames.size()) {
    side.left_out.push_back(fmt::format("{}: {} of {} frames are used: images of the next one are missing",
                                        folder.string(), side.run.frames.size(), rows));
  }
  if (side.run.drive.size() < side.run.frames.size()) {
    side.left_out.push_back(fmt::format("{}: wheel angles of {} of {} frames are known", folder.string(),
                                        side.run.drive.size(), side.run.frames.size()));
  }
  drop_broken_end(side);
  if (side.run.frames.size() < kLeastFrames) {
    return Error{ErrorCode::kBadData, fmt::format("{}: has {} whole frames, a comparison needs {} or more",
                                                  folder.string(), side.run.frames.size(), kLeastFrames)};
  }
  if (!poses.empty()) {
    const auto given = runlog::read_poses(poses);
    side.reference = at_times(side.run.frames, given);
    if (std::ranges::none_of(side.reference, [](const auto& pose) { return pose.has_value(); })) {
      return Error{
          ErrorCode::kBadData,
          fmt::format("{}: none of its {} poses is at the time of a frame of {}, which are from {:.3f} to {:.3f} s",
                      poses.string(), given.size(), folder.string(), side.run.frames.front().t_s,
                      side.run.frames.back().t_s)};
    }
    side.reference_is = "given trajectory";
    side.is_reference_apart = true;
  } else if (!side.run.truth.empty()) {
    side.reference = runlog::at_frames(side.run, side.run.truth);
    side.reference_is = "truth";
    side.is_reference_apart = true;
  }
  return side;
}

void calibrate_side(Side& side, int frames, const std::function<void(double)>& progress) {
  const calibrate::Settings settings{
      .frames = frames, .leave_out_unreadable = true, .fit_timing = true, .progress = progress};
  side.chosen = frames;
  auto calibrated = calibrate::calibrate({side.run}, side.run.robot, settings);
  if (!calibrated) {
    side.why_no_calibration = calibrated.error().message;
    return;
  }
  side.calibration = *std::move(calibrated);
  ask_the_map(side);
  side.found = side.calibration->after;
}

}  // namespace twocone::compare

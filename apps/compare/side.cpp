// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/side.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/compare/matching.h"
#include "apps/files/file_error.h"
#include "apps/files/to_layers.h"
#include "apps/runs/run_folder.h"
#include "apps/runs/run_yaml.h"
#include "apps/runs/tables.h"

namespace twocone::compare {
namespace {

// Below this, rates, means and calibrations are of nothing.
constexpr std::size_t kLeastFrames = vision::CalibrationResult::kMinFrames;

/// The given trajectory at the frames' times; nothing where two of its poses are farther apart in time than
/// kLongestGap_s.
std::vector<std::optional<runs::PoseRow>> at_times(const std::vector<runs::FrameRow>& frames,
                                                   std::vector<runs::PoseRow> poses) {
  constexpr double kLongestGap_s = 1.0;
  std::stable_sort(poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.t_s < b.t_s; });
  std::vector<std::optional<runs::PoseRow>> result;
  for (const runs::FrameRow& frame : frames) result.push_back(pose_at(poses, frame.t_s, kLongestGap_s));
  return result;
}

/// Where the results of method `full` are, as read_run names them.
std::string full_method_of(const std::filesystem::path& folder, const runs::RunInfo& info) {
  const std::string full(runs::to_string(runs::Method::kFull));
  if (std::filesystem::exists(folder / "methods" / full / "sightings.csv")) return full;
  if (info.method == full && std::filesystem::exists(folder / "sightings.csv")) return "";
  throw files::FileError(
      fmt::format("{}: has no sightings of method {}; make them with: twocone localise {} --method {}", folder.string(),
                  full, folder.string(), full));
}

/// Whether landmarks stand elsewhere than the map says, which a second solution is asked that does not trust it; the
/// first, which does, tells all else better. Where some do, the rig is found again with these where they are.
void ask_the_map(Side& side) {
  calibrate::Report& report = *side.calibration;
  vision::CalibrationProblem doubting = report.problem;
  doubting.landmark_sigma_m = kMapSigma_m;
  const vision::CalibrationResult result = vision::calibrate(doubting);
  if (result.verdict != vision::CalibrationVerdict::kOk) return;
  // exp(-limit / 2): one landmark of a run in a hundred thousand.
  const double limit = -2 * std::log(1e-5);
  const auto shifts = vision::shifts_among(result, doubting.landmarks, limit);
  bool has_moved = false;
  for (const vision::RelativeShift& shift : shifts) {
    side.map_shifts.emplace_back(side.run.map.landmarks.at(shift.shift.landmark).name, shift);
    has_moved = has_moved || shift.moved;
    if (shift.moved) doubting.landmarks[shift.shift.landmark].place_m += shift.shift.shift_m;
  }
  if (!has_moved) return;
  doubting.landmark_sigma_m = 0;
  const vision::CalibrationResult again = vision::calibrate(doubting);
  if (again.verdict != vision::CalibrationVerdict::kOk) return;
  report.problem.landmarks = doubting.landmarks;
  calibrate::take(again, side.run.robot, report);
}

/// Leaves out last frames whose pictures are not whole: a recording that was cut off ends in one. Where more than that
/// are broken, something else is wrong with them, and they are told of one by one as they are looked at.
void drop_broken_end(Side& side) {
  constexpr int kMost = 2;
  runs::RunData& run = side.run;
  for (int i = 0; i < kMost && !run.frames.empty(); ++i) {
    const std::uint64_t frame = run.frames.back().frame;
    const auto lower = runs::read_picture(runs::lower_picture(run.folder, frame));
    const auto upper = runs::read_picture(runs::upper_picture(run.folder, frame));
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
    return Error{ErrorCode::kBadData,
                 fmt::format("{}: there is no frames.csv, so no frame of it is known", folder.string())};
  }
  const std::string method = full_method_of(folder, runs::read_run_yaml(folder).info);
  runs::RunData run = runs::read_run(folder, method, runs::Tables::kFrames);
  const vision::Rig believed = files::to_rig(run.robot);
  Side side{.name = folder.string(),
            .run = std::move(run),
            .method = method,
            .calibration = std::nullopt,
            .why_no_calibration = {},
            .map_shifts = {},
            .left_out = {},
            .believed = believed,
            .found = believed,
            .reference = {},
            .reference_is = {}};
  const std::size_t rows = runs::read_frames(folder / "frames.csv").size();
  if (rows > side.run.frames.size()) {
    side.left_out.push_back(fmt::format("{}: {} of {} frames are taken: pictures of the next one are missing",
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
    const auto given = runs::read_poses(poses);
    side.reference = at_times(side.run.frames, given);
    const auto known =
        std::count_if(side.reference.begin(), side.reference.end(), [](const auto& p) { return bool(p); });
    if (known == 0) {
      return Error{
          ErrorCode::kBadData,
          fmt::format("{}: none of its {} poses is at the time of a frame of {}, which are from {:.3f} to {:.3f} s",
                      poses.string(), given.size(), folder.string(), side.run.frames.front().t_s,
                      side.run.frames.back().t_s)};
    }
    side.reference_is = "given trajectory";
    side.is_reference_apart = true;
  } else if (!side.run.truth.empty()) {
    side.reference = runs::at_frames(side.run, side.run.truth);
    side.reference_is = "truth";
    side.is_reference_apart = true;
  }
  return side;
}

void calibrate_side(Side& side, int frames, const std::function<void(double)>& progress) {
  calibrate::Settings settings;
  settings.frames = frames;
  settings.fit_timing = true;
  settings.leave_out_unreadable = true;
  settings.progress = progress;
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

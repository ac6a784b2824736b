// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/both_runs.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/estimation/estimator.h"
#include "apps/estimation/method.h"
#include "apps/runlog/answer_rows.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/tables/tables.h"
#include "localisation/odometry.h"
#include "vision/calibration.h"
#include "vision/triangulation.h"

namespace twocone::compare {
namespace {

// Shorter runs give no meaningful rates, means or calibrations.
constexpr std::size_t kLeastFrames = vision::CalibrationResult::kMinFrames;

/// Returns the given trajectory at the frames' times. A frame has no pose between two poses of the trajectory that are
/// more than kLongestGap_s apart.
std::vector<std::optional<runlog::PoseRow>> at_times(const std::vector<runlog::FrameRow>& frames,
                                                     std::vector<runlog::PoseRow> poses) {
  constexpr double kLongestGap_s = 1.0;
  std::ranges::stable_sort(poses, {}, &runlog::PoseRow::t_s);
  std::vector<std::optional<runlog::PoseRow>> result;
  result.reserve(frames.size());
  for (const runlog::FrameRow& frame : frames) result.push_back(pose_at(poses, frame.t_s, kLongestGap_s));
  return result;
}

/// Returns the name of the method for read_run() that gives the results of method `outline`; empty for those in the run
/// folder itself.
std::string outline_method_of(const std::filesystem::path& folder, const runlog::RunInfo& info) {
  std::string outline(estimation::to_string(estimation::Method::kOutline));
  if (std::filesystem::exists(folder / "methods" / outline / "sightings.csv")) return outline;
  if (info.method == outline && std::filesystem::exists(folder / "sightings.csv")) return "";
  throw config::FileError("{}: has no sightings of method {}; make them with: twocone localise {} --method {}",
                          folder.string(), outline, folder.string(), outline);
}

/// Tests whether landmarks are elsewhere than in the map. A second solution with a wide prior on the map decides this.
/// The first one, which trusts the map, determines everything else better. If landmarks have moved, the rig is
/// calibrated again with their measured places.
void ask_the_map(Side& side) {
  calibrate::Report& report = *side.calibration;
  vision::CalibrationProblem doubting = report.problem;
  // Prior standard deviation of a landmark's place about its place in the map, in each coordinate.
  constexpr double kDoubt_m = 0.02;
  for (Landmark& landmark : doubting.landmarks) landmark.sigma.x_m = landmark.sigma.y_m = kDoubt_m;
  const vision::CalibrationResult result = vision::calibrate(doubting);
  if (result.verdict != vision::CalibrationVerdict::kOk) return;
  // A shift without a cause exceeds the limit with probability exp(-limit / 2): one landmark in a hundred thousand.
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
  for (std::size_t i = 0; i < doubting.landmarks.size(); ++i) {
    doubting.landmarks[i].sigma = report.problem.landmarks[i].sigma;
  }
  const vision::CalibrationResult again = vision::calibrate(doubting);
  if (again.verdict != vision::CalibrationVerdict::kOk) return;
  report.problem.landmarks = doubting.landmarks;
  calibrate::take(again, side.run.robot, report);
}

/// Leaves out the last frames if their images are incomplete, because a recording that was cut off ends in such a
/// frame. At most kMost frames are left out. If more are broken, the cause is another one, and each is reported when it
/// is read.
void drop_broken_end(Side& side) {
  constexpr int kMost = 2;
  runlog::RunData& run = side.run;
  for (int i = 0; i < kMost && !run.frames.empty(); ++i) {
    const auto files = images_of(run, run.frames.size() - 1);
    const auto lower = runlog::read_image(files[0]), upper = runlog::read_image(files[1]);
    if (lower && upper) return;
    side.left_out.push_back(fmt::format("frame {} is left out: {}", run.frames.back().frame,
                                        lower ? upper.error().message : lower.error().message));
    run.frames.pop_back();
    const auto shorten = [&run](auto& rows) {
      if (rows.size() > run.frames.size()) rows.resize(run.frames.size());
    };
    shorten(run.drive);
    shorten(run.truth);
    shorten(run.odometry);
  }
}

/// The range and the sightings of a landmark in one frame.
struct Seen {
  const runlog::RangeRow* range = nullptr;
  std::optional<vision::Sighting> lower, upper;
};

std::vector<Seen> by_landmark(const config::Map& map, const runlog::AnswerRows& rows) {
  std::vector<Seen> seen(map.landmarks.size());
  const auto find = [&](const std::string& name) {
    const auto at = std::ranges::find(map.landmarks, name, &config::Landmark::name);
    return at == map.landmarks.end() ? nullptr : &seen[std::size_t(at - map.landmarks.begin())];  // null: another map's
  };
  for (const runlog::RangeRow& row : rows.ranges) {
    if (Seen* const s = find(row.landmark)) s->range = &row;
  }
  for (const runlog::SightingRow& row : rows.sightings) {
    Seen* const s = find(row.landmark);
    if (!s) continue;
    vision::Sighting sighting;
    sighting.pixel_px = {row.column_px, row.row_px};
    sighting.covariance_px2 << row.var_column_px2, row.cov_px2, row.cov_px2, row.var_row_px2;
    if (sighting.covariance_px2.llt().info() != Eigen::Success) continue;
    (row.view == to_string(vision::Side::kLower) ? s->lower : s->upper) = sighting;
  }
  return seen;
}

/// Returns whether the landmark itself was sighted. Under a wrong rig, ranges may fail although sightings are right.
bool is_trusted(const runlog::RangeRow& row) {
  using vision::RangeVerdict;
  constexpr std::array kTrusted{RangeVerdict::kOk, RangeVerdict::kOneView, RangeVerdict::kInconsistent,
                                RangeVerdict::kBeyondLimit};
  return std::ranges::any_of(kTrusted, [&](RangeVerdict v) { return row.verdict == to_string(v); });
}

/// Returns the disparity of the landmark's top in the undistorted images, as defined in triangulate().
std::optional<double> disparity_at(const vision::Rig& rig, const Eigen::Vector2d& in_body_m, const Landmark& target) {
  const auto radius_px = [&](const vision::MirrorView& view) -> std::optional<double> {
    const auto point = vision::near_top_point(view, in_body_m, target.radius_m, target.top_m);
    const auto pixel = point ? view.project(*point) : std::nullopt;
    const auto undistorted = pixel ? view.undistort_px(*pixel) : std::nullopt;
    return undistorted ? std::optional((*undistorted - view.settings().centre_px).norm()) : std::nullopt;
  };
  const auto lower_px = radius_px(rig.lower), upper_px = radius_px(rig.upper);
  if (!lower_px || !upper_px) return std::nullopt;
  return *lower_px - *upper_px * rig.lower.focal_length_px() / rig.upper.focal_length_px();
}

/// Returns the measurement of each landmark from a frame's sightings under `rig`, in the map's order. A landmark
/// without sightings has verdict kNotSeen.
std::vector<vision::RangeMeasurement> ranges_under(const vision::Rig& rig, const config::Map& map,
                                                   const runlog::AnswerRows& rows) {
  const auto targets = config::to_targets(map);
  const auto seen = by_landmark(map, rows);
  std::vector<vision::RangeMeasurement> ranges(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i].range || !is_trusted(*seen[i].range)) continue;
    ranges[i] = range_under(rig, seen[i].lower, seen[i].upper, targets[i]);
  }
  return ranges;
}

}  // namespace

Result<Side> read_side(const std::filesystem::path& folder, const std::filesystem::path& poses) {
  if (std::filesystem::exists(folder / "run.yaml") && !std::filesystem::exists(folder / "frames.csv")) {
    return Error(ErrorCode::kBadData, "{}: there is no frames.csv, so it has no frames", folder.string());
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
    return Error(ErrorCode::kBadData, "{}: has {} whole frames, a comparison needs {} or more", folder.string(),
                 side.run.frames.size(), kLeastFrames);
  }
  if (!poses.empty()) {
    const auto given = runlog::read_poses(poses);
    side.reference = at_times(side.run.frames, given);
    if (std::ranges::none_of(side.reference, [](const auto& pose) { return pose.has_value(); })) {
      return Error(ErrorCode::kBadData,
                   "{}: none of its {} poses is at the time of a frame of {}, which are from {:.3f} to {:.3f} s",
                   poses.string(), given.size(), folder.string(), side.run.frames.front().t_s,
                   side.run.frames.back().t_s);
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
      .frames = frames, .leave_out_unreadable = true, .start_from_images = false, .progress = progress};
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

localisation::Pose pose_of(const runlog::PoseRow& row) { return {row.x_m, row.y_m, row.heading_rad}; }

std::optional<runlog::PoseRow> pose_of(const localisation::Fix& fix, double t_s) {
  if (fix.verdict != localisation::FixVerdict::kOk || !fix.position_m || !fix.heading_rad) return std::nullopt;
  return runlog::PoseRow{t_s, fix.position_m->x(), fix.position_m->y(), *fix.heading_rad};
}

vision::RangeMeasurement range_under(const vision::Rig& rig, const std::optional<vision::Sighting>& lower,
                                     const std::optional<vision::Sighting>& upper, const Landmark& target) {
  const vision::Triangulation t =
      vision::triangulate(rig, lower ? &*lower : nullptr, upper ? &*upper : nullptr, target.radius_m, target.top_m);
  vision::RangeMeasurement m;
  m.verdict = t.verdict;
  m.range_m = t.range_m;
  m.bearing_rad = t.bearing_rad;
  m.covariance = t.covariance;
  m.disparity_px = t.disparity_px;
  return m;
}

void locate(Side& side) {
  if (side.is_reference_apart) return;
  side.reference_is = "estimate";
  side.reference.assign(side.run.frames.size(), std::nullopt);
  const auto landmarks_m = config::to_landmark_positions(side.run.map);
  runlog::AnswerReader reader(side.run.folder, side.method);
  for (std::size_t i = 0; i < side.run.frames.size(); ++i) {
    const runlog::FrameRow& frame = side.run.frames[i];
    const auto ranges = ranges_under(side.found, side.run.map, reader.of(frame.frame));
    side.reference[i] = pose_of(estimation::fix_of_outline(ranges, landmarks_m, true), frame.t_s);
  }
}

Residuals residuals_of(const Side& side) {
  Residuals all;
  const config::Map& map = side.run.map;
  const auto targets = config::to_targets(map);
  const auto landmarks_m = config::to_landmark_positions(map);
  const std::size_t count = map.landmarks.size();
  all.frames = side.run.frames.size();
  all.has_range.assign(all.frames * count, false);
  const std::size_t every = (all.frames * count + Residuals::kMostPoints - 1) / Residuals::kMostPoints;
  runlog::AnswerReader reader(side.run.folder, side.method);
  for (std::size_t i = 0; i < all.frames; ++i) {
    const runlog::FrameRow& frame = side.run.frames[i];
    const runlog::AnswerRows rows = reader.of(frame.frame);
    const auto& reference = side.reference[i];
    const auto after = ranges_under(side.found, map, rows);
    const auto seen = by_landmark(map, rows);
    for (std::size_t k = 0; k < count; ++k) {
      if (!seen[k].range) continue;
      const runlog::RangeRow& row = *seen[k].range;
      ++all.looked_for;
      if (!row.range_m) continue;
      ++all.ranged;
      all.has_range[i * count + k] = true;
      if (!reference) continue;
      const Eigen::Vector2d to_m = localisation::in_body(pose_of(*reference), landmarks_m[k]);
      ResidualPoint point{frame.t_s, k, to_m.norm(), *row.range_m - to_m.norm(), std::nullopt};
      all.range_m.add(point.before_m);
      if (after[k].range_m) point.after_m = *after[k].range_m - to_m.norm();
      if (row.bearing_rad) {
        all.bearing_rad.add(localisation::wrap_angle_rad(*row.bearing_rad - std::atan2(to_m.y(), to_m.x())));
      }
      const auto disparity = row.disparity_px ? disparity_at(side.believed, to_m, targets[k]) : std::nullopt;
      if (disparity) all.disparity_px.add(*row.disparity_px - *disparity);
      if ((i * count + k) % every == 0) all.points.push_back(point);
    }
    if (rows.fixes.empty()) continue;
    const runlog::FixRow& fix = rows.fixes.front();
    all.outliers += fix.outliers.size();
    if (!fix.x_m || !fix.y_m || is_out_of_bounds(fix)) continue;
    ++all.with_fix;
    if (side.is_reference_apart && reference) {
      all.fix_m.add(std::hypot(*fix.x_m - reference->x_m, *fix.y_m - reference->y_m));
    }
  }
  return all;
}

}  // namespace twocone::compare

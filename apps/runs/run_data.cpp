// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/run_data.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/files/file_error.h"
#include "apps/files/text_file.h"
#include "apps/runs/results_exchange.h"
#include "apps/runs/run_yaml.h"
#include "apps/runs/tables.h"
#include "localisation/fix.h"

namespace twocone::runs {
namespace {

/// A .tum file's time may be rounded to the microsecond, and frames are milliseconds apart at the least.
constexpr double kSameInstant_s = 0.5e-3;

}  // namespace

bool has_odometry(const RunData& run) { return !run.odometry.empty(); }

bool is_out_of_bounds(const FixRow& row) { return row.verdict == to_string(localisation::FixVerdict::kOutOfBounds); }

std::optional<PoseRow> pose_of(const TrackRow& row) {
  if (!row.x_m || !row.y_m || !row.heading_rad) return std::nullopt;
  return PoseRow{row.t_s, *row.x_m, *row.y_m, *row.heading_rad};
}

std::vector<std::optional<PoseRow>> at_frames(const RunData& run, const std::vector<PoseRow>& poses) {
  std::vector<PoseRow> sorted = poses;
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.t_s < b.t_s; });
  std::vector<std::optional<PoseRow>> result;
  for (const FrameRow& frame : run.frames) {
    const auto found = std::lower_bound(sorted.begin(), sorted.end(), frame.t_s - kSameInstant_s,
                                        [](const PoseRow& pose, double t_s) { return pose.t_s < t_s; });
    const bool there = found != sorted.end() && found->t_s <= frame.t_s + kSameInstant_s;
    result.push_back(there ? std::optional(*found) : std::nullopt);
  }
  return result;
}

std::filesystem::path camera_picture(const std::filesystem::path& run, const std::string& camera, std::uint64_t frame) {
  return run / camera / fmt::format("{:06}.png", frame);
}
std::filesystem::path lower_picture(const std::filesystem::path& run, std::uint64_t frame) {
  return camera_picture(run, "lower", frame);
}
std::filesystem::path upper_picture(const std::filesystem::path& run, std::uint64_t frame) {
  return camera_picture(run, "upper", frame);
}

namespace {

/// The method asked for last, whose results lie on top; nothing while a run has no summary.
std::optional<std::string> method_of(const std::filesystem::path& results) {
  const std::filesystem::path file = results / "summary.json";
  if (!std::filesystem::exists(file)) return std::nullopt;
  const auto json = nlohmann::json::parse(files::read_text(file), nullptr, false);
  if (!json.is_object() || !json.contains("method") || !json["method"].is_string()) return std::nullopt;
  return json["method"].get<std::string>();
}

}  // namespace

std::filesystem::path results_folder(const std::filesystem::path& run, const std::string& method) {
  std::filesystem::path results = method.empty() ? top_results(run) : run / "methods" / method;
  if (!std::filesystem::is_directory(results)) {
    throw files::FileError(fmt::format("{}: no results of method {}; make them with: twocone localise {} --method {}",
                                       run.string(), method, run.string(), method));
  }
  return results;
}

RunData read_run(const std::filesystem::path& folder, const std::string& method, Tables tables) {
  // A writer exchanges results within milliseconds: the second reading is of one state, if it is not a run of many
  // localisations at once.
  constexpr int kMostReadings = 10;
  for (int reading = 1;; ++reading) {
    const std::string before = results_state(folder);
    const auto is_one_state = [&] { return reading == kMostReadings || results_state(folder) == before; };
    try {
      const std::filesystem::path results = results_folder(folder, method);
      RunData run = read_run_with(folder, results, method, tables);
      if (is_one_state()) return run;
    } catch (const files::FileError&) {
      if (is_one_state()) throw;
    }
  }
}

RunData read_run_with(const std::filesystem::path& folder, const std::filesystem::path& results,
                      const std::string& method, Tables tables) {
  RunData run;
  run.folder = folder;
  RunYaml yaml = read_run_yaml(folder);
  run.info = std::move(yaml.info);
  run.robot = std::move(yaml.robot);
  run.map = std::move(yaml.map);
  run.method = method.empty() ? method_of(results).value_or(run.info.method) : method;

  // Written last, so read first: a row in it stands for a frame whose other rows are there.
  if (!std::filesystem::exists(folder / "frames.csv")) {
    throw files::FileError(fmt::format("{}: frames.csv is missing, which says what frames there are", folder.string()));
  }
  run.frames = read_frames(folder / "frames.csv");
  run.drive = read_drive(folder / "drive.csv");
  run.truth = read_poses(folder / "truth.tum");
  run.odometry = read_poses(folder / "odometry.tum");
  if (tables == Tables::kAll) {
    run.ranges = read_ranges(results / "ranges.csv");
    run.fixes = read_fixes(results / "fixes.csv");
    run.sightings = read_sightings(results / "sightings.csv");
    run.effort = read_effort(results / "effort.csv");
    run.track = read_track(results / "track.csv");
  }
  run.estimate = read_poses(results / "estimate.tum");

  const std::size_t count = run.frames.size();
  const bool no_odometry = run.odometry.empty() && run.drive.empty() && run.info.behaviour == kImported;
  if ((run.odometry.size() < count && !no_odometry) || (!run.truth.empty() && run.truth.size() < count)) {
    throw files::FileError(fmt::format("{}: frames.csv has {} frames, but odometry.tum {} and truth.tum {}",
                                       folder.string(), count, run.odometry.size(), run.truth.size()));
  }
  if (!no_odometry) run.odometry.resize(count);
  if (!run.truth.empty()) run.truth.resize(count);
  if (run.drive.size() > count) run.drive.resize(count);
  const auto beyond = [&run](const auto& row) { return run.frames.empty() || row.frame > run.frames.back().frame; };
  std::erase_if(run.ranges, beyond);
  std::erase_if(run.fixes, beyond);
  std::erase_if(run.sightings, beyond);
  std::erase_if(run.effort, beyond);
  std::erase_if(run.track, beyond);
  std::erase_if(run.estimate,
                [&run](const PoseRow& row) { return run.frames.empty() || row.t_s > run.frames.back().t_s; });
  return run;
}

}  // namespace twocone::runs

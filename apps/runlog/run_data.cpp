// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/run_data.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/names.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/results_exchange.h"
#include "apps/runlog/tables/tables.h"
#include "localisation/fix.h"
#include "localisation/odometry.h"

namespace twocone::runlog {
namespace {

/// The time in a .tum file may be rounded to a microsecond. Frames are at least milliseconds apart.
constexpr double kSameTime_s = 0.5e-3;

/// Returns the method of the results at the top of the folder, or nothing if the run has no summary.
std::optional<std::string> method_of(const std::filesystem::path& results) {
  const std::filesystem::path file = results / "summary.json";
  if (!std::filesystem::exists(file)) return std::nullopt;
  const auto json = nlohmann::json::parse(config::read_text(file), nullptr, false);
  if (!json.is_object() || !json.contains("method") || !json["method"].is_string()) return std::nullopt;
  return std::string(config::present_name(config::NameOf::kMethod, json["method"].get<std::string>()));
}

/// Returns `folder`/`name`, or the file that has the name of an older version.
std::filesystem::path present(const std::filesystem::path& folder, config::NameOf kind, const std::string& name) {
  const auto old = config::old_name(kind, name);
  if (old && !std::filesystem::exists(folder / name) && std::filesystem::exists(folder / *old)) return folder / *old;
  return folder / name;
}

}  // namespace

bool has_odometry(const RunData& run) { return !run.odometry.empty(); }

void check_drive(const RunData& run) {
  if (!has_odometry(run) || run.drive.size() >= run.frames.size()) return;
  throw config::FileError("{}: frames.csv has {} frames, but drive.csv {}", run.folder.string(), run.frames.size(),
                          run.drive.size());
}

std::optional<BodyTwist> twist_between(const config::Robot& robot, const DriveRow& before, const DriveRow& after) {
  const double time_s = after.t_s - before.t_s;
  if (!(time_s > 0)) return std::nullopt;
  const localisation::WheelTurns turned{after.left_rad - before.left_rad, after.right_rad - before.right_rad};
  return localisation::twist_of(config::to_wheels(robot), turned, time_s);
}

std::optional<BodyTwist> twist_at(const RunData& run, std::size_t row) {
  if (row == 0 || row >= run.drive.size()) return std::nullopt;
  return twist_between(run.robot, run.drive[row - 1], run.drive[row]);
}

bool is_out_of_bounds(const FixRow& row) { return row.verdict == to_string(localisation::FixVerdict::kOutOfBounds); }

std::optional<PoseRow> pose_of(const TrackRow& row) {
  if (!row.x_m || !row.y_m || !row.heading_rad) return std::nullopt;
  return PoseRow{row.t_s, *row.x_m, *row.y_m, *row.heading_rad};
}

std::vector<std::optional<PoseRow>> at_frames(const RunData& run, const std::vector<PoseRow>& poses) {
  std::vector<PoseRow> sorted = poses;
  std::ranges::sort(sorted, {}, &PoseRow::t_s);
  std::vector<std::optional<PoseRow>> result;
  for (const FrameRow& frame : run.frames) {
    const auto found = std::ranges::lower_bound(sorted, frame.t_s - kSameTime_s, {}, &PoseRow::t_s);
    const bool there = found != sorted.end() && found->t_s <= frame.t_s + kSameTime_s;
    result.push_back(there ? std::optional(*found) : std::nullopt);
  }
  return result;
}

std::filesystem::path camera_image_file(const std::filesystem::path& run, const std::string& camera,
                                        std::uint64_t frame) {
  return run / camera / fmt::format("{:06}.png", frame);
}
std::filesystem::path lower_image_file(const std::filesystem::path& run, std::uint64_t frame) {
  return camera_image_file(run, "lower", frame);
}
std::filesystem::path upper_image_file(const std::filesystem::path& run, std::uint64_t frame) {
  return camera_image_file(run, "upper", frame);
}
std::filesystem::path cloud_file(const std::filesystem::path& run, std::uint64_t frame) {
  return run / "clouds" / fmt::format("{:06}.ply", frame);
}
std::array<std::filesystem::path, 2> images_of(const RunData& run, std::size_t row) {
  const std::uint64_t frame = run.frames[row].frame;
  return {lower_image_file(run.folder, frame), upper_image_file(run.folder, frame)};
}

std::filesystem::path results_folder(const std::filesystem::path& run, const std::string& method) {
  std::filesystem::path results =
      method.empty() ? top_results(run) : present(run / "methods", config::NameOf::kMethod, method);
  if (!std::filesystem::is_directory(results)) {
    if (method.empty()) throw config::FileError("{}: no such folder", results.string());
    throw config::FileError("{}: no results of method {}; make them with: twocone localise {} --method {}",
                            run.string(), method, run.string(), method);
  }
  return results;
}

RunData read_run(const std::filesystem::path& folder, const std::string& method, Tables tables) {
  // A writer exchanges results within milliseconds. The second reading sees one state, unless many localisations of one
  // run take place at the same time.
  constexpr int kMostReadings = 10;
  for (int reading = 1;; ++reading) {
    const std::string before = results_state(folder);
    const auto is_one_state = [&] { return reading == kMostReadings || results_state(folder) == before; };
    try {
      const std::filesystem::path results = results_folder(folder, method);
      RunData run = read_run_with(folder, results, method, tables);
      if (is_one_state()) return run;
    } catch (const config::FileError&) {
      if (is_one_state()) throw;
    }
  }
}

RunData read_run_with(const std::filesystem::path& folder, const std::filesystem::path& results,
                      const std::string& method, Tables tables) {
  RunData run;
  static_cast<RunYaml&>(run) = read_run_yaml(folder);
  run.folder = folder;
  run.method = method.empty() ? method_of(results).value_or(run.info.method) : method;

  // frames.csv is written last and therefore read first. For each of its rows, the rows of the other tables exist.
  if (!std::filesystem::exists(folder / "frames.csv")) {
    throw config::FileError("{}: frames.csv is missing, which lists the frames", folder.string());
  }
  run.frames = read_table<FrameRow>(folder / "frames.csv");
  run.drive = read_table<DriveRow>(folder / "drive.csv");
  run.truth = read_poses(folder / "truth.tum");
  run.odometry = read_poses(folder / "odometry.tum");
  const auto read_rows = [&run]<typename Row>(const std::filesystem::path& file, std::vector<Row>& rows) {
    rows = read_table<Row>(file);
    std::erase_if(rows, [&run](const Row& row) { return run.frames.empty() || row.frame > run.frames.back().frame; });
  };
  if (tables == Tables::kAll) {
    read_rows(results / "ranges.csv", run.ranges);
    read_rows(results / "fixes.csv", run.fixes);
    read_rows(results / "sightings.csv", run.sightings);
    read_rows(present(results, config::NameOf::kFile, "timing.csv"), run.timing);
    read_rows(results / "track.csv", run.track);
  }
  run.estimate = read_poses(results / "estimate.tum");
  std::erase_if(run.estimate,
                [&run](const PoseRow& row) { return run.frames.empty() || row.t_s > run.frames.back().t_s; });

  const std::size_t count = run.frames.size();
  const bool no_odometry = run.odometry.empty() && run.drive.empty() && run.info.behaviour == kImported;
  if ((run.odometry.size() < count && !no_odometry) || (!run.truth.empty() && run.truth.size() < count)) {
    throw config::FileError("{}: frames.csv has {} frames, but odometry.tum {} and truth.tum {}", folder.string(),
                            count, run.odometry.size(), run.truth.size());
  }
  if (!no_odometry) run.odometry.resize(count);
  if (!run.truth.empty()) run.truth.resize(count);
  if (run.drive.size() > count) run.drive.resize(count);
  return run;
}

}  // namespace twocone::runlog

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"

namespace twocone::runs {

/// What the cameras of a real robot did beside what frames.csv tells.
struct CaptureCounts {
  std::uint64_t lower_skipped = 0, upper_skipped = 0;  ///< frames passed over for newer ones: the program was late
  std::uint64_t unpaired = 0;                          ///< frames without a partner within the skew limit
  std::uint64_t recoveries = 0;                        ///< how often a camera went away and came back
};

/// The behaviour of a run that another program recorded (apps/foreign).
inline constexpr const char* kImported = "imported";

/// A file that a run was made from, as it was then.
struct SourceFile {
  std::string file;    ///< absolute
  std::string digest;  ///< of its bytes (scene_files.h)

  friend bool operator==(const SourceFile&, const SourceFile&) = default;
};

/// run.yaml: enough to repeat the run.
struct RunInfo {
  std::string version;  ///< of twocone
  std::string commit;   ///< of its source, or "unknown"
  std::string compiler;
  std::string behaviour;  ///< wander, waypoints, still, or kImported
  std::string method;     ///< asked for when it was run
  std::uint64_t seed = 0;
  int frames_wanted = 0;
  bool truth = false;                         ///< RunOptions::truth
  std::vector<SourceFile> scene_files{};      ///< the scene and what it names; none on hardware
  std::vector<std::string> effects;           ///< of the simulation that are on, each with its reason; none on hardware
  std::vector<std::string> import_options{};  ///< of kImported: words of the command but for --out
  std::vector<std::string> devices{};         ///< of a real robot: what each is and what it made of its settings
  std::optional<CaptureCounts> capture{};     ///< of a real robot
  bool finished = false;                      ///< false: the run was cut off, by a kill, a full disk or a device
  double wall_s = 0;                          ///< of the whole run; 0 if it was cut off
  double render_wait_s = 0;                   ///< of that, waiting for pictures
  double own_cpu_s = 0;                       ///< processor time of this program
  double render_cpu_s = 0;                    ///< processor time of the programs it started: POV-Ray
  std::vector<std::string> events;            ///< what happened on the way, a sentence each
};

/// A row of frames.csv.
struct FrameRow {
  std::uint64_t frame = 0;
  double t_s = 0, skew_s = 0, lower_t_s = 0, upper_t_s = 0;
  std::uint64_t lower_sequence = 0, upper_sequence = 0;
  std::uint64_t lower_lost = 0, upper_lost = 0;
  std::optional<double> host_t_s{};  ///< since the run began, on the machine's steady clock; none: imported
};

/// A row of drive.csv: speeds as commanded, angles as read; on devices between the readings around the frame's time.
struct DriveRow {
  double t_s = 0;
  std::optional<double> left_command_radps, right_command_radps;  ///< none: imported, not known
  double left_rad = 0, right_rad = 0;
};

/// A row of ranges.csv. Fields that do not apply are empty.
struct RangeRow {
  std::uint64_t frame = 0;
  double t_s = 0;
  std::string landmark;
  std::string verdict;
  std::optional<double> range_m, sigma_range_m, bearing_rad, sigma_bearing_rad, disparity_px, true_range_m;
};

/// A row of sightings.csv: where one view shows a landmark (vision::Sighting). Methods that make none have no such
/// file.
struct SightingRow {
  std::uint64_t frame = 0;
  double t_s = 0;
  std::string landmark;
  std::string view;                  ///< lower or upper
  double column_px = 0, row_px = 0;  ///< of the near point of its top
  double var_column_px2 = 0, cov_px2 = 0, var_row_px2 = 0;
  std::optional<double> edge_noise_px;  ///< of the outline's place, for each pixel of its length; none: not measured
};

/// A row of fixes.csv.
struct FixRow {
  std::uint64_t frame = 0;
  double t_s = 0;
  std::string verdict;
  std::optional<double> x_m, y_m, heading_rad;
  std::optional<double> var_x_m2, cov_xy_m2, var_y_m2, var_heading_rad2;
  std::optional<double> true_x_m, true_y_m, error_m;
  std::vector<std::string> outliers;  ///< landmarks whose measurement was found wrong and left out
  std::optional<double> cov_x_heading_m_rad{}, cov_y_heading_m_rad{};
  /// Of `weak`: the unit vector of (x m, y m, heading rad) along which the covariance says nothing.
  std::optional<double> unseen_x{}, unseen_y{}, unseen_heading{};
};

/// Whether the position is shown but is no answer: it counts as a frame without a fix.
bool is_out_of_bounds(const FixRow& row);

/// A row of track.csv: what the robot takes for its pose at a frame, and what became of the frame's fix (track.h).
struct TrackRow {
  std::uint64_t frame = 0;
  double t_s = 0;
  std::string state{};  ///< of the filter: lost or tracking; empty without a filter
  std::optional<double> x_m{}, y_m{}, heading_rad{};
  std::optional<double> var_x_m2{}, cov_xy_m2{}, var_y_m2{};
  std::optional<double> cov_x_heading_m_rad{}, cov_y_heading_m_rad{}, var_heading_rad2{};
  std::string fix{};  ///< its verdict, as in fixes.csv
  std::string use{};  ///< localisation::FixUse
};

/// A row of effort.csv: what a frame's answer took (Effort). This table alone is of the machine and the moment: the
/// same run again has other times, and with a budget other verdicts.
struct EffortRow {
  std::uint64_t frame = 0;
  double t_s = 0;
  double vision_s = 0, localisation_s = 0, wall_s = 0;
  int refined = 0;
  std::string verdict{};  ///< with a budget, kept or over; else empty
};

/// A row of a .tum file, planar.
struct PoseRow {
  double t_s = 0, x_m = 0, y_m = 0, heading_rad = 0;
};

/// A run folder in memory (DESIGN.md, "A run on disk"); the pictures stay on disk.
struct RunData {
  std::filesystem::path folder;
  RunInfo info;
  files::Robot robot;
  files::Map map;
  std::string method;  ///< whose ranges, fixes and estimate these are
  std::vector<FrameRow> frames;
  std::vector<DriveRow> drive;
  std::vector<RangeRow> ranges;
  std::vector<FixRow> fixes;
  std::vector<SightingRow> sightings;  ///< none of a method that makes none
  std::vector<EffortRow> effort;       ///< none of a run of an older version
  std::vector<TrackRow> track;         ///< one a frame; none of a run of an older version
  std::vector<PoseRow> truth;          ///< one a frame; empty on hardware
  std::vector<PoseRow> odometry;       ///< one a frame; empty, as drive is, of an imported run without wheels
  std::vector<PoseRow> estimate;
};

/// False: nobody recorded the wheels; drive and odometry are empty.
bool has_odometry(const RunData& run);

/// A line of estimate.tum; nothing where the track has no pose with a heading.
std::optional<PoseRow> pose_of(const TrackRow& row);

/// The pose at each of the run's frames, by time; nothing where `poses` has none.
std::vector<std::optional<PoseRow>> at_frames(const RunData& run, const std::vector<PoseRow>& poses);

std::filesystem::path lower_picture(const std::filesystem::path& run, std::uint64_t frame);
std::filesystem::path upper_picture(const std::filesystem::path& run, std::uint64_t frame);
/// Of any camera, by its name in the robot file: those of the pair are `lower` and `upper`.
std::filesystem::path camera_picture(const std::filesystem::path& run, const std::string& camera, std::uint64_t frame);

/// What read_run takes into memory.
enum class Tables {
  kAll,
  kFrames,  ///< not ranges, fixes, sightings, effort and track, which are the long ones (apps/runs/answer_reader.h)
};

/// Reads a finished or a cut-off run, also one that is being written: a half-written last line of a table is left out,
/// and rows beyond the last of frames.csv too; results that are replaced meanwhile are read again.
/// Pictures are not looked for. @param method of methods/NAME; empty: those on top
/// @throws files::FileError naming file and line; frames.csv is missing
RunData read_run(const std::filesystem::path& folder, const std::string& method = "", Tables tables = Tables::kAll);

/// The same with the tables of `method` that lie in `results`.
RunData read_run_with(const std::filesystem::path& folder, const std::filesystem::path& results,
                      const std::string& method, Tables tables = Tables::kAll);

/// Where the tables of a method are: methods/METHOD; empty: on top. @throws files::FileError where there are none
std::filesystem::path results_folder(const std::filesystem::path& run, const std::string& method);

}  // namespace twocone::runs

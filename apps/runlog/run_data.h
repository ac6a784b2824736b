// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"

namespace twocone::runlog {

/// Events of a real robot's cameras that frames.csv does not contain.
struct CaptureCounts {
  std::uint64_t lower_skipped = 0, upper_skipped = 0;  ///< frames dropped for newer ones because the program was late
  std::uint64_t unpaired = 0;                          ///< frames without a partner within the skew limit
  std::uint64_t recoveries = 0;                        ///< number of times a camera disappeared and came back
};
/// Their keys in run.yaml and summary.json.
inline constexpr std::array kCaptureCounts{std::pair{"lower_skipped", &CaptureCounts::lower_skipped},
                                           std::pair{"upper_skipped", &CaptureCounts::upper_skipped},
                                           std::pair{"unpaired", &CaptureCounts::unpaired},
                                           std::pair{"recoveries", &CaptureCounts::recoveries}};

/// The behaviour of a run that another program recorded (apps/import).
inline constexpr const char* kImported = "imported";

/// Digests of the files from which a run was made, by their absolute paths.
using FileDigests = std::map<std::string, std::string>;

/// Returns the files of a map's scene. These are the scene and each file in its folder or in the map's `scene_paths:`
/// that the scene or one of its .inc or .pov files names in quotes. POV-Ray's own libraries are left out. The digest is
/// 64-bit FNV-1a. It detects accidental changes and does not protect against forgery. Requires a map that names a
/// scene. A file that cannot be read is left out, because rendering reports it.
FileDigests scene_files(const config::Map& map);

/// The content of run.yaml, which is enough to repeat the run.
struct RunInfo {
  std::string version;  ///< of twocone
  std::string commit;   ///< of its source, or "unknown"
  std::string compiler;
  std::string behaviour;  ///< RunOptions::behaviour, or kImported
  std::string method;     ///< the method at the time of the run
  std::uint64_t seed = 0;
  int frames_wanted = 0;
  bool truth = false;      ///< RunOptions::truth
  bool real_time = false;  ///< RunOptions::real_time
  bool maps = false;       ///< RunOptions::maps
  bool telemetry = false;  ///< RunOptions::telemetry
  /// What rendered the images: "native", "native unchecked" (it was not compared with POV-Ray) or "povray". Empty: on
  /// hardware, in a served world, and before the first image.
  std::string renderer{};
  FileDigests scene_files{};                  ///< the scene and the files that it names; none on hardware
  std::vector<std::string> effects;           ///< active in the simulation, each with its reason; none on hardware
  std::vector<std::string> import_options{};  ///< of kImported: words of the command without --out
  std::vector<std::string> devices{};         ///< of a real robot: each device and the settings that it accepted
  std::optional<CaptureCounts> capture{};     ///< of a real robot
  bool finished = false;                      ///< false: the run was cut off by a kill, a full disk or a device
  double wall_s = 0;                          ///< of the whole run; 0 if it was cut off
  double render_wait_s = 0;                   ///< part of it spent waiting for images
  double own_cpu_s = 0;                       ///< processor time of this program
  double render_cpu_s = 0;                    ///< processor time of its child processes: POV-Ray
  std::vector<std::string> events;            ///< events during the run, one sentence each
};
/// The keys of the program and of the times that a run took, in run.yaml and summary.json.
inline constexpr std::array kProgramKeys{std::pair{"twocone", &RunInfo::version}, std::pair{"commit", &RunInfo::commit},
                                         std::pair{"compiler", &RunInfo::compiler}};
inline constexpr std::array kTimeKeys{
    std::pair{"wall_s", &RunInfo::wall_s}, std::pair{"render_wait_s", &RunInfo::render_wait_s},
    std::pair{"own_cpu_s", &RunInfo::own_cpu_s}, std::pair{"render_cpu_s", &RunInfo::render_cpu_s}};

/// The content of run.yaml: info, robot and map.
struct RunYaml {
  RunInfo info;
  config::Robot robot;
  config::Map map;
};

/// A row of frames.csv.
struct FrameRow {
  std::uint64_t frame = 0;
  double t_s = 0, skew_s = 0, lower_t_s = 0, upper_t_s = 0;
  std::uint64_t lower_sequence = 0, upper_sequence = 0;
  std::uint64_t lower_lost = 0, upper_lost = 0;
  std::optional<double> host_t_s{};  ///< since the start of the run, on the machine's steady clock; none: imported
};

/// A row of drive.csv: commanded speeds and measured angles. On devices the angles are interpolated at the frame's
/// time.
struct DriveRow {
  double t_s = 0;
  std::optional<double> left_command_radps, right_command_radps;  ///< none: unknown, since the run is imported
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

/// A row of sightings.csv: the position of a landmark in one view (vision::Sighting). A method without sightings has no
/// such file.
struct SightingRow {
  std::uint64_t frame = 0;
  double t_s = 0;
  std::string landmark;
  std::string view;                  ///< lower or upper
  double column_px = 0, row_px = 0;  ///< of the near point of the landmark's top
  double var_column_px2 = 0, cov_px2 = 0, var_row_px2 = 0;
  std::optional<double> edge_noise_px;  ///< of the outline's position, per pixel of its length; none: not measured
};

/// A row of landmarks.csv: a landmark that a run without a map of landmarks has found until then. Other runs have no
/// such file.
struct LandmarkRow {
  std::uint64_t frame = 0;
  double t_s = 0;
  std::string landmark;  ///< by hue and number: red.1
  double x_m = 0, y_m = 0, top_m = 0, radius_m = 0;
  double var_x_m2 = 0, cov_xy_m2 = 0, var_y_m2 = 0, sigma_top_m = 0, sigma_radius_m = 0;
  std::uint64_t sightings = 0;  ///< number of frames that showed it
};

/// A row of fixes.csv.
struct FixRow {
  std::uint64_t frame = 0;
  double t_s = 0;
  std::string verdict;
  std::optional<double> x_m, y_m, heading_rad;
  std::optional<double> var_x_m2, cov_xy_m2, var_y_m2, var_heading_rad2;
  std::optional<double> true_x_m, true_y_m, error_m;
  std::vector<std::string> outliers;  ///< landmarks whose measurement was rejected and left out
  std::optional<double> cov_x_heading_m_rad{}, cov_y_heading_m_rad{};
  /// Only for `weak`: the unit vector of (x m, y m, heading rad) along which the covariance gives no information.
  std::optional<double> unseen_x{}, unseen_y{}, unseen_heading{};
  /// The part of the covariance that the images' noise causes. It averages away over frames; the rest comes from map
  /// and rig and does not.
  std::optional<double> own_var_x_m2{}, own_cov_xy_m2{}, own_var_y_m2{}, own_var_heading_rad2{};
};

/// Returns whether the row has a position that is not an answer. Such a row counts as a frame without a fix.
bool is_out_of_bounds(const FixRow& row);

/// A row of track.csv: the robot's estimate of its pose at a frame, and the use of the frame's fix (track.h).
struct TrackRow {
  std::uint64_t frame = 0;
  double t_s = 0;
  std::string state{};  ///< of the filter: lost or tracking; empty without a filter
  std::optional<double> x_m{}, y_m{}, heading_rad{};
  std::optional<double> var_x_m2{}, cov_xy_m2{}, var_y_m2{};
  std::optional<double> cov_x_heading_m_rad{}, cov_y_heading_m_rad{}, var_heading_rad2{};
  std::string fix{};   ///< its verdict, as in fixes.csv
  std::string use{};   ///< localisation::FixUse
  std::string plan{};  ///< likewise, of the pose by the floor plan; empty without estimator.plan
};

/// A row of scan.csv: a beam of a frame's scan (vision::Beam). Runs that do not scan have no such file.
struct ScanRow {
  std::uint64_t frame = 0;
  double t_s = 0;
  double beam_rad = 0;  ///< bearing of its middle, body frame
  std::string state{};  ///< vision::BeamState
  std::optional<double> range_m{}, sigma_m{};
};

/// A row of timing.csv: the time and work for a frame's answer (Timing). Only this table depends on the machine. A
/// repeated run has other times and, with a time budget, other verdicts.
struct TimingRow {
  std::uint64_t frame = 0;
  double t_s = 0;
  double vision_s = 0, localisation_s = 0, wall_s = 0;
  int refined = 0;
  std::string verdict{};  ///< with a time budget, kept or over; else empty
};

/// A row of a .tum file, planar.
struct PoseRow {
  double t_s = 0, x_m = 0, y_m = 0, heading_rad = 0;
};

/// A run folder in memory (docs/file-formats.md). The images stay on disk.
struct RunData : RunYaml {
  std::filesystem::path folder;
  std::string method;  ///< the method of these ranges, fixes and estimate
  std::vector<FrameRow> frames;
  std::vector<DriveRow> drive;
  std::vector<RangeRow> ranges;
  std::vector<FixRow> fixes;
  std::vector<SightingRow> sightings;  ///< empty for a method without sightings
  std::vector<TimingRow> timing;       ///< empty for a run of an older version
  std::vector<TrackRow> track;         ///< one per frame; empty for a run of an older version
  std::vector<PoseRow> truth;          ///< one per frame; empty on hardware
  std::vector<PoseRow> odometry;       ///< one per frame; empty, as is drive, for an imported run without wheels
  std::vector<PoseRow> estimate;
};

/// Returns false if the wheels were not recorded. Then drive and odometry are empty.
bool has_odometry(const RunData& run);
/// @throws config::FileError if the wheels were recorded, but not for every frame
void check_drive(const RunData& run);

/// Returns the motion of the body between two readings of the wheels, from their believed sizes; nothing if they have
/// the same time.
std::optional<BodyTwist> twist_between(const config::Robot& robot, const DriveRow& before, const DriveRow& after);
/// Returns the motion of the body before a row of run.frames. The interval before the row is used because an image is
/// never newer than its stamp. Returns nothing for the first row, and if readings are missing or have the same time.
std::optional<BodyTwist> twist_at(const RunData& run, std::size_t row);

/// Returns a line of estimate.tum, or nothing if the track has no pose with a heading.
std::optional<PoseRow> pose_of(const TrackRow& row);

/// Returns the pose at the time of each frame of the run, or nothing where `poses` has none.
std::vector<std::optional<PoseRow>> at_frames(const RunData& run, const std::vector<PoseRow>& poses);

std::filesystem::path lower_image_file(const std::filesystem::path& run, std::uint64_t frame);
std::filesystem::path upper_image_file(const std::filesystem::path& run, std::uint64_t frame);
/// Returns the image file of any camera, by its name in the robot file. Those of the pair are `lower` and `upper`.
std::filesystem::path camera_image_file(const std::filesystem::path& run, const std::string& camera,
                                        std::uint64_t frame);
/// Returns the file of a frame's point cloud (`twocone scan --clouds`).
std::filesystem::path cloud_file(const std::filesystem::path& run, std::uint64_t frame);
/// Returns the files of a frame's images, lower and upper. @param row of the frame in `run.frames`
std::array<std::filesystem::path, 2> images_of(const RunData& run, std::size_t row);

/// The tables that read_run loads into memory.
enum class Tables {
  kAll,
  kFrames,  ///< without ranges, fixes, sightings, timing and track, which are long
            ///< (apps/runlog/answer_rows.h: AnswerReader)
};

/// Reads a finished run, a run that was cut off, or one that is being written. It leaves out an incomplete last line of
/// a table and rows beyond the last row of frames.csv. It reads results again if they are replaced meanwhile. It does
/// not look for images.
/// @param method of methods/NAME; empty: the results at the top of the folder
/// @throws config::FileError that names file and line; also if frames.csv is missing
RunData read_run(const std::filesystem::path& folder, const std::string& method = "", Tables tables = Tables::kAll);

/// Like read_run, with the tables of `method` in the folder `results`.
RunData read_run_with(const std::filesystem::path& folder, const std::filesystem::path& results,
                      const std::string& method, Tables tables = Tables::kAll);

/// Returns the folder of a method's tables, methods/METHOD; empty: the top. @throws config::FileError if there are none
std::filesystem::path results_folder(const std::filesystem::path& run, const std::string& method);

// ---- run.yaml

/// Writes run.yaml of `folder` with the robot file and the map as they are on disk, with absolute paths. `estimator:`
/// is that of `robot`, because the command line may change it.
/// @throws DiskError, config::FileError
void write_run_yaml(const std::filesystem::path& folder, const RunInfo& info, const config::Robot& robot,
                    const std::filesystem::path& map_file);

/// Files of what is believed, instead of what a run was made with. Empty: as in the run, or as the robot file says.
struct OtherBeliefs {
  std::filesystem::path robot_file, map_file;
};

/// Writes run.yaml of `to` as that of `from`, with other beliefs and an event that reports them.
/// @param other names the map
/// @throws DiskError, config::FileError
void write_run_yaml_for(const OtherBeliefs& other, const std::filesystem::path& from, const std::filesystem::path& to);

/// Writes run.yaml of `to` as that of `from`, with the map of `map_file` and the event `event`.
/// @throws DiskError, config::FileError
void write_run_yaml_for_map(const std::filesystem::path& from, const std::filesystem::path& map_file,
                            const std::string& event, const std::filesystem::path& to);

RunYaml read_run_yaml(const std::filesystem::path& folder);

/// Returns the first difference between the robot file and map in run.yaml and the present files, for example
/// "robots/lab_sim.yaml: drive.wheel_radius_m was 0.05, and is 0.06". Empty: no difference. @throws config::FileError
std::string changed_since(const std::filesystem::path& folder);

}  // namespace twocone::runlog

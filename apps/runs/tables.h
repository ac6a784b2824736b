// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/files/text_file.h"
#include "apps/runs/run_data.h"

/// The text form of a run folder's tables, both ways (DESIGN.md, "A run on disk"). Numbers are written so that reading
/// gives the same double; a field that does not apply is empty.
namespace twocone::runs {

std::string frames_header();
std::string drive_header();
std::string ranges_header();
std::string fixes_header();
std::string sightings_header();
std::string effort_header();
std::string track_header();

std::string to_line(const FrameRow& row);
std::string to_line(const DriveRow& row);
std::string to_line(const RangeRow& row);
std::string to_line(const FixRow& row);
std::string to_line(const SightingRow& row);
std::string to_line(const EffortRow& row);
/// The heading is kept to 1e-9 rad, as in the .tum files, since that of method paper comes from one.
std::string to_line(const TrackRow& row);
/// TUM: t tx ty tz qx qy qz qw. The heading is kept to 1e-9 rad.
std::string to_line(const PoseRow& row);

/// A table row by row, for runs of any length. A last line without its newline was being written when the program
/// ended, and is left out. A file that is not there is an empty table. Row: any of the above but PoseRow.
template <typename Row>
class TableReader {
 public:
  /// @throws files::FileError for another header
  explicit TableReader(const std::filesystem::path& file);

  /// Nothing at the end. @throws files::FileError: FILE:LINE: what is wrong
  std::optional<Row> next();

 private:
  std::filesystem::path file_;
  std::optional<files::TextLines> lines_;
  std::size_t missing_ = 0;  ///< of the last columns, in a table of an older version
};

/// Each reads a table whole, as TableReader does.
std::vector<FrameRow> read_frames(const std::filesystem::path& file);
std::vector<DriveRow> read_drive(const std::filesystem::path& file);
std::vector<RangeRow> read_ranges(const std::filesystem::path& file);
/// Also of older versions, whose tables lack the last columns: outliers, or what follows them.
std::vector<FixRow> read_fixes(const std::filesystem::path& file);
std::vector<SightingRow> read_sightings(const std::filesystem::path& file);
std::vector<EffortRow> read_effort(const std::filesystem::path& file);
std::vector<TrackRow> read_track(const std::filesystem::path& file);
std::vector<PoseRow> read_poses(const std::filesystem::path& file);

}  // namespace twocone::runs

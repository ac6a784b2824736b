// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_data.h"

/// Writes and reads a run folder's tables as text (docs/file-formats.md). Numbers are written so that reading
/// gives the same double. A field that does not apply is empty.
namespace twocone::runlog {

std::string frames_header();
std::string drive_header();
std::string ranges_header();
std::string fixes_header();
std::string sightings_header();
std::string timing_header();
std::string track_header();

std::string to_line(const FrameRow& row);
std::string to_line(const DriveRow& row);
std::string to_line(const RangeRow& row);
std::string to_line(const FixRow& row);
std::string to_line(const SightingRow& row);
std::string to_line(const TimingRow& row);
/// The heading is kept to 1e-9 rad, as in the .tum files, because the heading of method paper comes from such a file.
std::string to_line(const TrackRow& row);
/// TUM: t tx ty tz qx qy qz qw. The heading is kept to 1e-9 rad.
std::string to_line(const PoseRow& row);

/// Reads a table row by row, for runs of any length. A last line without its newline is left out, because the program
/// ended while it wrote that line. A missing file counts as an empty table. Row: any of the types above except PoseRow.
template <typename Row>
class TableReader {
 public:
  /// @throws config::FileError for a wrong header
  explicit TableReader(const std::filesystem::path& file);

  /// Returns nothing at the end. @throws config::FileError: FILE:LINE: the fault
  std::optional<Row> next();

 private:
  std::filesystem::path file_;
  std::optional<config::TextLines> lines_;
  std::size_t missing_ = 0;  ///< number of last columns that a table of an older version lacks
};

/// Each function reads a whole table, as TableReader does.
std::vector<FrameRow> read_frames(const std::filesystem::path& file);
std::vector<DriveRow> read_drive(const std::filesystem::path& file);
std::vector<RangeRow> read_ranges(const std::filesystem::path& file);
/// Also reads tables of older versions, which lack the last columns: outliers, or the columns after it.
std::vector<FixRow> read_fixes(const std::filesystem::path& file);
std::vector<SightingRow> read_sightings(const std::filesystem::path& file);
std::vector<TimingRow> read_timing(const std::filesystem::path& file);
std::vector<TrackRow> read_track(const std::filesystem::path& file);
std::vector<PoseRow> read_poses(const std::filesystem::path& file);

}  // namespace twocone::runlog

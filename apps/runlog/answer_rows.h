// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/estimation/estimator.h"
#include "apps/estimation/track.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/tables/tables.h"
#include "vision/beam.h"

namespace twocone::runlog {

/// An answer as rows of the tables, compared with the truth if it is known.
struct AnswerRows {
  std::vector<RangeRow> ranges;
  std::vector<FixRow> fixes;  ///< one, or two for an ambiguous frame
  std::vector<SightingRow> sightings;
  std::vector<LandmarkRow> landmarks{};
  /// The time and work for the answer.
  std::optional<TimingRow> timing{};
  /// The result of the track (track.h); estimate.tum is written from it too.
  std::optional<TrackRow> track{};
};
/// Returns the rows for the answer of a frame, without timing and track.
/// @param answer ranges in the map's order; the outliers of its fix are indices of ranges
/// @param truth the true pose; null on hardware
AnswerRows to_rows(std::uint64_t frame, double t_s, const estimation::FrameAnswer& answer, const config::Map& map,
                   const PoseRow* truth);

/// Returns a row of track.csv. @param fix the fix from which `answer` was made
TrackRow to_row(std::uint64_t frame, double t_s, const localisation::Fix& fix, const estimation::TrackAnswer& answer);

/// Returns the rows of scan.csv for the scan of a frame, rounded to 0.1 mm and 1e-5 rad.
std::vector<ScanRow> to_rows(std::uint64_t frame, double t_s, const std::vector<vision::Beam>& scan);
/// Returns the scans of a table, frame by frame: state, range and sigma of each beam.
std::map<std::uint64_t, std::vector<vision::Beam>> read_scans(const std::filesystem::path& file);

/// Reads the answers of a run's method from its tables, frame by frame. One frame is in memory at a time.
class AnswerReader {
 public:
  /// @param method as read_run. @throws config::FileError as read_run
  AnswerReader(const std::filesystem::path& run, const std::string& method);

  /// Returns ranges, fixes and sightings of `frame`. The lists are empty if the tables have none. The caller must
  /// request frames in rising order and may skip frames. @throws config::FileError as TableReader
  AnswerRows of(std::uint64_t frame);

 private:
  template <typename Row>
  struct Table {
    explicit Table(const std::filesystem::path& file) : reader(file), row(reader.next()) {}
    TableReader<Row> reader;
    std::optional<Row> row;  ///< the next one
  };
  template <typename Row>
  static std::vector<Row> take(Table<Row>& table, std::uint64_t frame);

  Table<RangeRow> ranges_;
  Table<FixRow> fixes_;
  Table<SightingRow> sightings_;
};

}  // namespace twocone::runlog

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "apps/runlog/answer_rows.h"
#include "apps/runlog/tables/tables.h"

namespace twocone::runlog {

/// Reads the answers of a run's method from its tables, frame by frame. One frame is in memory at a time.
class AnswerReader {
 public:
  /// @param method as read_run. @throws config::FileError as read_run
  AnswerReader(const std::filesystem::path& run, const std::string& method);

  /// Returns ranges, fixes and sightings of `frame`; the lists are empty where the tables have none. The caller must
  /// ask for frames in rising order and may skip frames. @throws config::FileError as TableReader
  runlog::AnswerRows of(std::uint64_t frame);

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

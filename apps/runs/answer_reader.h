// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "apps/runs/estimator.h"
#include "apps/runs/tables.h"

namespace twocone::runs {

/// What a run's method said, frame by frame, from its tables: in memory is one frame.
class AnswerReader {
 public:
  /// @param method as read_run. @throws files::FileError as read_run
  AnswerReader(const std::filesystem::path& run, const std::string& method);

  /// Ranges, fixes and sightings of `frame`; empty lists where the tables have none. Frames are asked for in rising
  /// order; those in between are passed over. @throws files::FileError as TableReader
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

}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/tables/answer_reader.h"

namespace twocone::runlog {

AnswerReader::AnswerReader(const std::filesystem::path& run, const std::string& method)
    : ranges_(results_folder(run, method) / "ranges.csv"),
      fixes_(results_folder(run, method) / "fixes.csv"),
      sightings_(results_folder(run, method) / "sightings.csv") {}

template <typename Row>
std::vector<Row> AnswerReader::take(Table<Row>& table, std::uint64_t frame) {
  std::vector<Row> rows;
  for (; table.row && table.row->frame <= frame; table.row = table.reader.next()) {
    if (table.row->frame == frame) rows.push_back(*std::move(table.row));
  }
  return rows;
}

runlog::AnswerRows AnswerReader::of(std::uint64_t frame) {
  runlog::AnswerRows rows;
  rows.ranges = take(ranges_, frame);
  rows.fixes = take(fixes_, frame);
  rows.sightings = take(sightings_, frame);
  return rows;
}

}  // namespace twocone::runlog

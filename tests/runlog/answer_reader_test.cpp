// SPDX-License-Identifier: Apache-2.0
// Reads tables row by row: the answers of a run's method, frame by frame.
#include "apps/runlog/answer_rows.h"

#include <gtest/gtest.h>

#include "apps/config/robot_file.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runlog {
namespace {

using testing_support::TemporaryFolder;

std::string range_line(std::uint64_t frame, const std::string& landmark) {
  RangeRow row;
  row.frame = frame;
  row.landmark = landmark;
  row.verdict = "ok";
  return to_line(row) + "\n";
}

std::vector<std::string> landmarks_of(const AnswerRows& rows) {
  std::vector<std::string> names;
  for (const RangeRow& row : rows.ranges) names.push_back(row.landmark);
  return names;
}
using Names = std::vector<std::string>;

TEST(TableReader, ReturnsRowsAndLeavesOutAnIncompleteLastLine) {
  const TemporaryFolder folder;
  TableReader<RangeRow> reader(
      folder.write("ranges.csv",
                   TableReader<RangeRow>::header() + "\n" + range_line(1, "red") + range_line(2, "blue") + "3,0.2,gr"));
  EXPECT_EQ(reader.next()->landmark, "red");
  EXPECT_EQ(reader.next()->frame, 2U);
  EXPECT_FALSE(reader.next());
  EXPECT_FALSE(reader.next()) << "a second call at the end";
}

TEST(TableReader, OfAFileThatIsNotThereIsEmptyAndOfAHeaderAloneToo) {
  const TemporaryFolder folder;
  EXPECT_FALSE(TableReader<FixRow>(folder.path() / "not_there.csv").next());
  EXPECT_FALSE(TableReader<FixRow>(folder.write("fixes.csv", TableReader<FixRow>::header() + "\n")).next());
  EXPECT_FALSE(TableReader<FixRow>(folder.write("half.csv", TableReader<FixRow>::header().substr(0, 9))).next());
}

TEST(TableReader, NamesALineWhenItComesToIt) {
  const TemporaryFolder folder;
  const auto file =
      folder.write("ranges.csv", TableReader<RangeRow>::header() + "\n" + range_line(1, "red") + "2,0.2\n");
  TableReader<RangeRow> reader(file);
  EXPECT_TRUE(reader.next());
  EXPECT_EQ(testing_support::error_of<config::FileError>([&] { (void)reader.next(); }),
            file.string() + ":3: has 2 fields, must have 10");
  EXPECT_THROW(TableReader<RangeRow>(folder.write("other.csv", "a,b\n")), config::FileError);
}

TEST(AnswerReader, PassesOverTheRowsOfFramesThatAreNotAskedFor) {
  const TemporaryFolder folder;
  std::string ranges = TableReader<RangeRow>::header() + "\n";
  for (const std::uint64_t frame : {2, 3, 5, 8}) {
    for (const char* const name : {"red", "blue"}) ranges += range_line(frame, name + std::to_string(frame));
  }
  (void)folder.write("ranges.csv", ranges + "9,0.9,red9,ok");
  SightingRow sighting;
  sighting.frame = 5, sighting.landmark = "red5", sighting.view = "upper";
  (void)folder.write("sightings.csv", TableReader<SightingRow>::header() + "\n" + to_line(sighting) + "\n");
  AnswerReader reader(folder.path(), "");  // no fixes.csv
  EXPECT_EQ(landmarks_of(reader.of(0)), Names{}) << "before the first";
  EXPECT_EQ(landmarks_of(reader.of(2)), (Names{"red2", "blue2"}));
  EXPECT_EQ(landmarks_of(reader.of(4)), Names{}) << "3 is skipped, 4 has none";
  const AnswerRows rows = reader.of(5);
  EXPECT_EQ(landmarks_of(rows), (Names{"red5", "blue5"}));
  ASSERT_EQ(rows.sightings.size(), 1U);
  EXPECT_EQ(rows.sightings[0].view, "upper");
  EXPECT_TRUE(rows.fixes.empty());
  EXPECT_TRUE(reader.of(6).sightings.empty());
  EXPECT_EQ(landmarks_of(reader.of(9)), Names{}) << "its line is incomplete";
}

TEST(AnswerReader, RefusesAMethodWithoutResults) {
  const TemporaryFolder folder;
  EXPECT_THROW(AnswerReader(folder.path(), "outline"), config::FileError);
}

TEST(ReadRun, OfFramesAloneLeavesTheLongTablesOnDisk) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "run";
  {
    RunFolder run(path);
    const Image dark{4, 3, PixelFormat::kRgb8, std::vector<std::uint8_t>(36, 7)};
    FrameRecord record;
    record.truth = PoseRow{0, 1, 2, 0.5};
    record.answer.ranges.emplace_back().landmark = "red";
    record.answer.fixes.emplace_back().verdict = "ok";
    run.add(record, dark, dark);
  }
  RunInfo info;
  info.method = "outline";
  write_run_yaml(path, info, config::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml"),
                 TWOCONE_SOURCE_DIR "/scenes/lab.map.yaml");
  const RunData all = read_run(path), frames = read_run(path, "", Tables::kFrames);
  EXPECT_EQ(all.ranges.size(), 1U);
  EXPECT_EQ(all.fixes.size(), 1U);
  EXPECT_TRUE(frames.ranges.empty() && frames.fixes.empty() && frames.sightings.empty() && frames.timing.empty());
  EXPECT_EQ(frames.frames.size(), 1U);
  EXPECT_EQ(frames.drive.size(), 1U);
  EXPECT_EQ(frames.odometry.size(), 1U);
  ASSERT_EQ(frames.truth.size(), 1U);
  EXPECT_EQ(frames.truth[0].y_m, 2);
  EXPECT_EQ(frames.method, "outline");
}

}  // namespace
}  // namespace twocone::runlog

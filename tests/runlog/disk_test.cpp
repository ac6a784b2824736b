// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/disk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/runlog/run_folder.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/tables/tables.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runlog {
namespace {

using testing_support::error_of;
using testing_support::TemporaryFolder;

TEST(Disk, AWholeFileReplacesTheOldOneAndLeavesNoPart) {
  const TemporaryFolder folder;
  write_whole(folder.path() / "a.txt", "old");
  write_whole(folder.path() / "a.txt", "new");
  EXPECT_EQ(folder.read("a.txt"), "new");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.txt.part"));
}

TEST(Disk, LinesAreThereAtOnce) {
  const TemporaryFolder folder;
  LineFile lines(folder.path() / "a.csv");
  lines.add("1,2");
  EXPECT_EQ(folder.read("a.csv"), "1,2\n");
  lines.add("3,4");
  EXPECT_EQ(folder.read("a.csv"), "1,2\n3,4\n");
}

// Catches a table that becomes shorter while a run is resumed, and one that continues differently from its start.
TEST(Disk, KeptLinesStayAndMustBeTheSame) {
  const TemporaryFolder folder;
  const auto file = folder.write("a.csv", "a,b\n1,2.5\n3,4");  // killed in the middle of a line
  {
    LineFile lines(file, OldLines::kKeep);
    EXPECT_EQ(folder.read("a.csv"), "a,b\n1,2.5\n3,4");
    lines.add("a,b");
    lines.add("1,7", Equal::kButLastField);
    EXPECT_EQ(folder.read("a.csv"), "a,b\n1,2.5\n3,4") << "the old content is unchanged";
    lines.add("3,44");
    lines.add("5,6");
    EXPECT_EQ(folder.read("a.csv"), "a,b\n1,2.5\n3,44\n5,6\n");
  }
  {
    LineFile lines(file, OldLines::kKeep);
    lines.add("a,b");
    EXPECT_THAT(error_of<DiskError>([&] { lines.add("2,2.5", Equal::kButLastField); }),
                testing::HasSubstr("a.csv:2: is '1', but the repeated run gives '2'"));
  }
  LineFile lines(file, OldLines::kKeep);
  lines.add("anything", Equal::kNot);
  lines.add("1,2.5");
  EXPECT_THAT(error_of<DiskError>([&] { lines.add("3,4"); }), testing::HasSubstr("a.csv:3: is '3,44'"));
  EXPECT_EQ(folder.read("a.csv"), "a,b\n1,2.5\n3,44\n5,6\n");
}

TEST(Disk, SaysWhatCouldNotBeWrittenAndWhy) {
  const TemporaryFolder folder;
  const auto file = folder.write("file", "");
  EXPECT_EQ(error_of<DiskError>([&] { write_whole(file / "a", "x"); }),
            "cannot write " + (file / "a.part").string() + ": Not a directory");
  LineFile full("/dev/full");
  EXPECT_EQ(error_of<DiskError>([&] { full.add("x"); }), "cannot write /dev/full: No space left on device");
  EXPECT_EQ(error_of<DiskError>([&] { RunFolder run(file / "run"); }),
            "cannot make the folder " + (file / "run").string() + ": Not a directory");
}

// Catches a row in frames.csv whose images are not there yet, because a reader relies on that row.
TEST(Disk, OtherCamerasImagesLieBesideThePairs) {
  const TemporaryFolder folder;
  RunFolder run(folder.path() / "run");
  const auto image = [](std::uint8_t level) { return Image{1, 1, PixelFormat::kRgb8, {level, level, level}}; };
  FrameRecord record;
  record.frame.frame = 12;
  run.add(record, image(1), image(2),
          {{"front", std::make_shared<Image>(image(3))}, {"back", std::make_shared<Image>(image(4))}});
  for (const auto& [camera, level] : {std::pair{"lower", 1}, {"upper", 2}, {"front", 3}, {"back", 4}}) {
    const auto stored = read_image(camera_image_file(run.path(), camera, 12));
    ASSERT_TRUE(stored) << camera;
    EXPECT_EQ(stored->bytes[0], level) << camera;
  }
  EXPECT_EQ(read_table<FrameRow>(run.path() / "frames.csv").size(), 1U);

  (void)folder.write("run/left", "a file where a folder has to be");
  record.frame.frame = 13;
  EXPECT_THROW(run.add(record, image(1), image(2), {{"left", std::make_shared<Image>(image(5))}}), DiskError);
  EXPECT_EQ(read_table<FrameRow>(run.path() / "frames.csv").size(), 1U) << "a frame without all its images has a row";
}

// Catches sightings of another method beside ranges that were not made from them.
TEST(Disk, SightingsAreThereOnlyOfAMethodThatMakesThem) {
  const TemporaryFolder folder;
  AnswerRows answer;
  answer.fixes.resize(1);
  write_results(folder.path(), "paper", {answer}, OnTop::kYes);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "sightings.csv"));
  AnswerRows sighted = answer;
  sighted.sightings.resize(2);
  write_results(folder.path(), "outline", {sighted}, OnTop::kYes);
  EXPECT_EQ(read_table<SightingRow>(folder.path() / "sightings.csv").size(), 2U);
  write_results(folder.path(), "paper", {answer}, OnTop::kYes);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "sightings.csv"));
  EXPECT_EQ(read_table<SightingRow>(folder.path() / "methods" / "outline" / "sightings.csv").size(), 2U);

  RunFolder run(folder.path() / "run");
  const Image image{1, 1, PixelFormat::kRgb8, {1, 2, 3}};
  FrameRecord record;
  run.add(record, image, image);
  EXPECT_FALSE(std::filesystem::exists(run.path() / "sightings.csv"));
  record.frame.frame = 1;
  record.answer = sighted;
  record.answer.track = TrackRow{.frame = 1, .t_s = 0.1, .x_m = 2, .y_m = 3, .heading_rad = 0.5};
  run.add(record, image, image);
  file_results(run.path(), "outline");
  EXPECT_EQ(read_table<TrackRow>(run.path() / "methods" / "outline" / "track.csv").size(), 1U);
  EXPECT_EQ(read_poses(run.path() / "methods" / "outline" / "estimate.tum").size(), 1U);
  EXPECT_EQ(read_table<SightingRow>(run.path() / "methods" / "outline" / "sightings.csv").size(), 2U);
}

}  // namespace
}  // namespace twocone::runlog

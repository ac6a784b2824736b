// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/disk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/runs/run_folder.h"
#include "apps/runs/tables.h"
#include "apps/runs/truth_table.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runs {
namespace {

using testing_support::TemporaryFolder;

std::string error_of(const auto& call) {
  try {
    call();
  } catch (const DiskError& error) {
    return error.what();
  }
  return "no error";
}

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

// Catches a table that is shorter than before while a run is gone on with, and one that goes on otherwise than it
// began.
TEST(Disk, KeptLinesStayAndMustBeTheSame) {
  const TemporaryFolder folder;
  const auto file = folder.write("a.csv", "a,b\n1,2.5\n3,4");  // killed in the middle of a line
  {
    LineFile lines(file, OldLines::kKeep);
    EXPECT_EQ(folder.read("a.csv"), "a,b\n1,2.5\n3,4");
    lines.add("a,b");
    lines.add("1,7", Equal::kButLastField);
    EXPECT_EQ(folder.read("a.csv"), "a,b\n1,2.5\n3,4") << "what was there is as it was";
    lines.add("3,44");
    lines.add("5,6");
    EXPECT_EQ(folder.read("a.csv"), "a,b\n1,2.5\n3,44\n5,6\n");
  }
  {
    LineFile lines(file, OldLines::kKeep);
    lines.add("a,b");
    EXPECT_THAT(error_of([&] { lines.add("2,2.5", Equal::kButLastField); }),
                testing::HasSubstr("a.csv:2: is '1', but made again it is '2'"));
  }
  LineFile lines(file, OldLines::kKeep);
  lines.add("anything", Equal::kNot);
  lines.add("1,2.5");
  EXPECT_THAT(error_of([&] { lines.add("3,4"); }), testing::HasSubstr("a.csv:3: is '3,44'"));
  EXPECT_EQ(folder.read("a.csv"), "a,b\n1,2.5\n3,44\n5,6\n");
}

TEST(Disk, SaysWhatCouldNotBeWrittenAndWhy) {
  const TemporaryFolder folder;
  const auto file = folder.write("file", "");
  EXPECT_EQ(error_of([&] { write_whole(file / "a", "x"); }),
            "cannot write " + (file / "a.part").string() + ": Not a directory");
  LineFile full("/dev/full");
  EXPECT_EQ(error_of([&] { full.add("x"); }), "cannot write /dev/full: No space left on device");
  EXPECT_EQ(error_of([&] { RunFolder run(file / "run"); }),
            "cannot make the folder " + (file / "run").string() + ": Not a directory");
}

// Catches a row in frames.csv whose pictures are not there yet: a reader takes what is in it for whole.
TEST(Disk, OtherCamerasPicturesLieBesideThePairs) {
  const TemporaryFolder folder;
  RunFolder run(folder.path() / "run");
  const auto picture = [](std::uint8_t level) { return Image{1, 1, PixelFormat::kRgb8, {level, level, level}}; };
  FrameRecord record;
  record.frame.frame = 12;
  run.add(record, picture(1), picture(2),
          {{"front", std::make_shared<Image>(picture(3))}, {"back", std::make_shared<Image>(picture(4))}});
  for (const auto& [camera, level] : {std::pair{"lower", 1}, {"upper", 2}, {"front", 3}, {"back", 4}}) {
    const auto stored = read_picture(camera_picture(run.path(), camera, 12));
    ASSERT_TRUE(stored) << camera;
    EXPECT_EQ(stored->bytes[0], level) << camera;
  }
  EXPECT_EQ(read_frames(run.path() / "frames.csv").size(), 1U);

  (void)folder.write("run/left", "a file where a folder has to be");
  record.frame.frame = 13;
  EXPECT_THROW(run.add(record, picture(1), picture(2), {{"left", std::make_shared<Image>(picture(5))}}), DiskError);
  EXPECT_EQ(read_frames(run.path() / "frames.csv").size(), 1U) << "a frame without all its pictures has a row";
}

// Catches another method's sightings left beside ranges that do not rest on them.
TEST(Disk, SightingsAreThereOnlyOfAMethodThatMakesThem) {
  const TemporaryFolder folder;
  AnswerRows answer;
  answer.fixes.resize(1);
  write_results(folder.path(), "paper", {answer}, OnTop::kYes);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "sightings.csv"));
  AnswerRows sighted = answer;
  sighted.sightings.resize(2);
  write_results(folder.path(), "full", {sighted}, OnTop::kYes);
  EXPECT_EQ(read_sightings(folder.path() / "sightings.csv").size(), 2U);
  write_results(folder.path(), "paper", {answer}, OnTop::kYes);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "sightings.csv"));
  EXPECT_EQ(read_sightings(folder.path() / "methods" / "full" / "sightings.csv").size(), 2U);

  RunFolder run(folder.path() / "run");
  const Image picture{1, 1, PixelFormat::kRgb8, {1, 2, 3}};
  FrameRecord record;
  run.add(record, picture, picture);
  EXPECT_FALSE(std::filesystem::exists(run.path() / "sightings.csv"));
  record.frame.frame = 1;
  record.answer = sighted;
  record.answer.track = TrackRow{.frame = 1, .t_s = 0.1, .x_m = 2, .y_m = 3, .heading_rad = 0.5};
  run.add(record, picture, picture);
  file_results(run.path(), "full");
  EXPECT_EQ(read_track(run.path() / "methods" / "full" / "track.csv").size(), 1U);
  EXPECT_EQ(read_poses(run.path() / "methods" / "full" / "estimate.tum").size(), 1U);
  EXPECT_EQ(read_sightings(run.path() / "methods" / "full" / "sightings.csv").size(), 2U);
}

TEST(Disk, TheTruthIsATableBesideItsPicture) {
  const TemporaryFolder folder;
  const RunFolder run(folder.path() / "run");
  const auto file = truth_file(run.path(), "upper", 7);
  write_truth(file, {{3, 0, 1, 2.123456, 0.9}, {4, 0, 0, 1.5, 0.123451}}, {{"red", 0, 0, 1, 1}, {"a, b", 0, 0, 1, 1}});
  EXPECT_EQ(folder.read("run/upper/000007.truth.csv"),
            "column_px,row_px,landmark,distance_m,height_m\n3,0,\"a, b\",2.12346,0.90000\n4,0,red,1.50000,0.12345\n");
}

TEST(Disk, PicturesComeBackAsTheyWere) {
  const TemporaryFolder folder;
  Image image{5, 3, PixelFormat::kRgb8, {}};
  for (int i = 0; i < 45; ++i) image.bytes.push_back(std::uint8_t(5 * i));
  write_picture(folder.path() / "a.png", image);
  const auto again = read_picture(folder.path() / "a.png");
  ASSERT_TRUE(again);
  EXPECT_EQ(*again, image);
  image.format = PixelFormat::kBgr8;  // as a camera may deliver it: what is stored must show the same colours
  write_picture(folder.path() / "bgr.png", image);
  EXPECT_EQ(*read_picture(folder.path() / "bgr.png"), *to_rgb8(image));
  const Image grey{2, 1, PixelFormat::kGrey8, {7, 200}};
  write_picture(folder.path() / "grey.png", grey);
  EXPECT_EQ(*read_picture(folder.path() / "grey.png"), *to_rgb8(grey));
  EXPECT_EQ(read_picture(folder.path() / "b.png").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(read_picture(folder.write("c.png", "no picture")).error().code, ErrorCode::kBadData);
}

}  // namespace
}  // namespace twocone::runs

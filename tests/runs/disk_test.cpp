// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/disk.h"

#include <gtest/gtest.h>

#include "apps/runs/run_folder.h"
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

TEST(Disk, SaysWhatCouldNotBeWrittenAndWhy) {
  const TemporaryFolder folder;
  const auto file = folder.write("file", "");
  EXPECT_EQ(error_of([&] { write_whole(file / "a", "x"); }),
            "cannot write " + (file / "a.part").string() + ": Not a directory");
  LineFile full("/dev/full");
  EXPECT_EQ(error_of([&] { full.add("x"); }), "cannot write /dev/full: No space left on device");
  EXPECT_EQ(error_of([&] { RunFolder run(file / "run"); }),
            "cannot make the folder " + (file / "run" / "lower").string() + ": Not a directory");
}

TEST(Disk, PicturesComeBackAsTheyWere) {
  const TemporaryFolder folder;
  Image image{5, 3, PixelFormat::kRgb8, {}};
  for (int i = 0; i < 45; ++i) image.bytes.push_back(std::uint8_t(5 * i));
  write_picture(folder.path() / "a.png", image);
  const auto again = read_picture(folder.path() / "a.png");
  ASSERT_TRUE(again);
  EXPECT_EQ(*again, image);
  EXPECT_EQ(read_picture(folder.path() / "b.png").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(read_picture(folder.write("c.png", "no picture")).error().code, ErrorCode::kBadData);
}

}  // namespace
}  // namespace twocone::runs

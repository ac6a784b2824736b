// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "tests/config/fixtures.h"
#include "tests/support/temporary_folder.h"

namespace twocone::config {
namespace {

using testing_support::TemporaryFolder;

std::vector<std::string> lines_of(const std::filesystem::path& file) {
  TextLines lines(file);
  std::vector<std::string> all;
  while (auto line = lines.next()) {
    all.push_back(*std::move(line));
    EXPECT_EQ(lines.number(), all.size());
  }
  EXPECT_FALSE(lines.next()) << "a second call at the end";
  EXPECT_EQ(lines.number(), all.size()) << "the end is not a line";
  return all;
}

using Lines = std::vector<std::string>;

TEST(TextLines, AreReturnedWithoutTheirNewlines) {
  const TemporaryFolder folder;
  EXPECT_EQ(lines_of(folder.write("a", "one\n\nthree, \r\n")), (Lines{"one", "", "three, \r"}));
}

TEST(TextLines, AHalfWrittenLastLineIsNotReturned) {
  const TemporaryFolder folder;
  EXPECT_EQ(lines_of(folder.write("a", "one\ntwo\nthr")), (Lines{"one", "two"}));
  EXPECT_EQ(lines_of(folder.write("b", "no newline at all")), Lines{});
}

TEST(TextLines, OfAnEmptyFileThereAreNone) {
  const TemporaryFolder folder;
  EXPECT_EQ(lines_of(folder.write("a", "")), Lines{});
  EXPECT_EQ(lines_of(folder.write("b", "\n")), Lines{""});
}

TEST(TextLines, MayBeLongerThanABlockAndEndAnywhereInOne) {
  const TemporaryFolder folder;
  constexpr std::size_t kBlock = 1 << 14;  // read at once
  for (const std::size_t length : {kBlock - 2, kBlock - 1, kBlock, kBlock + 1, 3 * kBlock + 7}) {
    const Lines lines{std::string(length, 'a'), "b", std::string(length, 'c'), ""};
    std::string text;
    for (const std::string& line : lines) text += line + '\n';
    EXPECT_TRUE(lines_of(folder.write("a", text)) == lines) << length;
    EXPECT_TRUE(lines_of(folder.write("b", text + std::string(length, 'd'))) == lines) << length << " and a half line";
  }
}

TEST(TextLines, AFolderAndAMissingFileAreRejected) {
  const TemporaryFolder folder;
  EXPECT_EQ(message_of([&] { (void)TextLines(folder.path()); }),
            folder.path().string() + ": is a folder, must be a file");
  const auto nothing = folder.path() / "nothing";
  EXPECT_EQ(message_of([&] { (void)TextLines(nothing); }), nothing.string() + ": no such file");
}

}  // namespace
}  // namespace twocone::config

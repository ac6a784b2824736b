// SPDX-License-Identifier: Apache-2.0
#include "apps/import/images.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "apps/import/stamps.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::importer {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(Stamps, HaveAUnitByTheirFormOrAreRejected) {
  const auto unit = StampUnit::kAuto;
  EXPECT_EQ(parse_stamp("1403636579763555584", unit), Stamp(1403636579763555584)) << "EuRoC";
  EXPECT_EQ(parse_stamp("1305031102.175304", unit), Stamp(1305031102175304000)) << "TUM RGB-D";
  EXPECT_EQ(parse_stamp("0.0666666674", unit), Stamp(66666667));
  // These could be microseconds since 1970, or nanoseconds since some machine was switched on.
  EXPECT_FALSE(parse_stamp("1403636579763555", unit));
  for (const char* none : {"", ".", ".5", "12", "-1.5", "1.2.3", "1e3.0", "frame1.0", "99999999999.0"}) {
    EXPECT_FALSE(parse_stamp(none, unit)) << none;
  }
}

TEST(Stamps, HaveTheRequestedUnit) {
  EXPECT_EQ(parse_stamp("17", StampUnit::kSeconds), Stamp(17'000'000'000));
  EXPECT_EQ(parse_stamp("17.25", StampUnit::kMilliseconds), Stamp(17'250'000));
  EXPECT_EQ(parse_stamp("1403636579763555", StampUnit::kMicroseconds), Stamp(1403636579763555000));
  EXPECT_EQ(parse_stamp("17", StampUnit::kNanoseconds), Stamp(17));
}

TEST(Stamps, SecondsOfTablesMayBeNegativeAndHaveExponents) {
  EXPECT_EQ(parse_seconds("-0.25"), Stamp(-250'000'000));
  EXPECT_EQ(parse_seconds("2.5e-3"), Stamp(2'500'000));
  for (const char* none : {"", "-", "nan", "inf", "1e10", "2 s"}) EXPECT_FALSE(parse_seconds(none)) << none;
}

/// Checks the error messages of list_images().
class ImageLists : public testing::Test {
 protected:
  void touch(const std::string& name) {
    std::filesystem::create_directories(images_);
    static_cast<void>(folder_.write("images/" + name, "looked at by nobody here"));
  }
  std::string refusal(const std::string& times_file = "") {
    const std::string error =
        testing_support::error_of<config::FileError>([&] { list_images(images_, times_file, StampUnit::kAuto); });
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    return error;
  }
  std::string refusal_of_times(const std::string& text) { return refusal(folder_.write("times.txt", text)); }
  static std::vector<std::string> names(const ImageList& list) {
    std::vector<std::string> names;
    for (const StampedImage& image : list.images) names.push_back(image.file.filename());
    return names;
  }

  const testing_support::TemporaryFolder folder_;
  const std::filesystem::path images_ = folder_.path() / "images";
};

TEST_F(ImageLists, NamesAreSortedAsNumbers) {
  for (const char* name : {"10.5.png", "9.25.JPG", "100.0.jpeg", "notes.txt"}) touch(name);
  const ImageList list = list_images(images_, "", StampUnit::kAuto);
  EXPECT_THAT(names(list), ElementsAre("9.25.JPG", "10.5.png", "100.0.jpeg"));
  EXPECT_EQ(list.images[1].time, Stamp(10'500'000'000));
}

TEST_F(ImageLists, NamesThatAreNoTimesAreRefused) {
  touch("1.5.png");
  touch("frame_000002.png");
  EXPECT_THAT(refusal(), HasSubstr("frame_000002.png: the name is 'frame_000002', must be the time, seconds with a"));
}

TEST_F(ImageLists, OneTimeTwiceIsRefused) {
  touch("1.5.png");
  touch("1.50.png");
  EXPECT_THAT(refusal(), HasSubstr("1.50.png have the same time"));
}

TEST_F(ImageLists, NoFolderAndNoImageAreRefused) {
  EXPECT_THAT(refusal(), HasSubstr("is no folder"));
  touch("data.csv");
  EXPECT_THAT(refusal(), HasSubstr("no images here"));
}

TEST_F(ImageLists, FormsOfTimesFiles) {
  for (const char* name : {"a.png", "b c.png"}) touch(name);
  for (const char* text : {
           "# color images\n# file: 'x.bag'\n1305031102.175304 rgb/a.png\n1305031102.211214 rgb/b c.png\n",  // TUM
                                                                                                             // RGB-D
           "#timestamp [ns],filename\r\n1305031102175304000,a.png\r\n1305031102211214000,b c.png\r\n",       // EuRoC
           "\xEF\xBB\xBFtime,name\n1305031102.175304, a.png\n\n1305031102.211214, b c.png",
           "time\tname\n1305031102.175304\ta.png\n1305031102.211214\tb c.png\n",
       }) {
    const ImageList list = list_images(images_, folder_.write("times.txt", text), StampUnit::kAuto);
    EXPECT_THAT(names(list), ElementsAre("a.png", "b c.png")) << text;
    EXPECT_EQ(list.images[0].time, Stamp(1305031102175304000)) << text;
    EXPECT_EQ(list.images[1].time, Stamp(1305031102211214000)) << text;
    EXPECT_THAT(list.events, IsEmpty()) << text;
  }
}

TEST_F(ImageLists, WrongLinesAreNamed) {
  for (const char* name : {"a.png", "b.png", "c.png"}) touch(name);
  EXPECT_THAT(refusal_of_times("1.5 a.png\n1.25 b.png\n"), HasSubstr("times.txt:2: the time is 1.25, must be later"));
  EXPECT_THAT(refusal_of_times("1.5 a.png\n1.5 b.png\n"), HasSubstr("times.txt:2: the time is 1.5, must be later"));
  EXPECT_THAT(refusal_of_times("1.5 a.png\n2.5 a.png\n"), HasSubstr("times.txt:2: a.png stands on line 1, too"));
  EXPECT_THAT(refusal_of_times("1.5 a.png\nsoon b.png\n3.5 c.png\n"), HasSubstr("times.txt:2: the time is 'soon'"));
  EXPECT_THAT(refusal_of_times("1.5 a.png\n2.5\n3.5 c.png\n"), HasSubstr("times.txt:2: '2.5' must be TIME NAME"));
  EXPECT_THAT(refusal_of_times("1 a.png\n"), HasSubstr("times.txt:1: the time is '1', must be seconds with a"));
  EXPECT_THAT(refusal_of_times("1.5 a.png\n2.5 d.png\n3.5 c.png\n"), HasSubstr("times.txt:2: there is no image"));
  EXPECT_THAT(refusal_of_times("# nothing\n"), HasSubstr("names no image"));
  EXPECT_THAT(refusal(folder_.path() / "nowhere.txt"), HasSubstr("nowhere.txt"));
}

TEST_F(ImageLists, AnIncompleteLastLineIsLeftOut) {
  for (const char* name : {"a.png", "b.png", "c.png"}) touch(name);
  const auto cut = list_images(images_, folder_.write("times.txt", "1.5 a.png\n2.5 b.png\n3."), StampUnit::kAuto);
  EXPECT_THAT(names(cut), ElementsAre("a.png", "b.png"));
  EXPECT_THAT(cut.events, ElementsAre(HasSubstr("times.txt:3: the last line is left out: it was cut off"),
                                      HasSubstr("1 images that")));
  const auto gone = list_images(images_, folder_.write("times.txt", "1.5 a.png\n2.5 d.png\n"), StampUnit::kAuto);
  EXPECT_THAT(names(gone), ElementsAre("a.png"));
  EXPECT_THAT(gone.events, ElementsAre(HasSubstr("times.txt:2: the last line is left out: there is no image"),
                                       HasSubstr("2 images that")));
}

}  // namespace
}  // namespace twocone::importer

// SPDX-License-Identifier: Apache-2.0
// One run of POV-Ray. Shell scripts replace POV-Ray and misbehave in many ways.
#include "drivers/sim_povray/render/povray/povray.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sim_povray/test_support.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing_support::FailsWith;

// An image of 2 x 1 pixels.
constexpr const char* kPrintTwoPixels = "printf 'P6\\n# POV-Ray\\n2 1\\n255\\nabcdef'";

class PovrayTest : public testing::Test {
 protected:
  /// Returns the result of a job for which `commands` replace POV-Ray.
  ImageResult render(const std::string& commands, std::chrono::nanoseconds timeout = kChildLimit) {
    const Povray povray(folder_.script("povray", commands), folder_.path() / "lab.pov", timeout);
    return povray.render(plain_image("frame 12, view lower", "the scene", 2, 1, 1), -1);
  }
  Error error_of(const std::string& commands, std::chrono::nanoseconds timeout = kChildLimit) {
    auto result = render(commands, timeout);
    if (result) {
      ADD_FAILURE() << "an image resulted from: " << commands;
      return {ErrorCode::kInvalidState, ""};
    }
    return result.error();
  }
  [[nodiscard]] std::string scene_path() const { return (folder_.path() / "lab.pov").string(); }

  void TearDown() override { EXPECT_TRUE(children_of(::getpid()).empty()) << "a child was not reaped"; }

  TemporaryFolder folder_;
};

TEST_F(PovrayTest, ReturnsTheImage) {
  const auto image = value(render(kPrintTwoPixels));
  EXPECT_EQ(*image, (Image{2, 1, PixelFormat::kRgb8, {'a', 'b', 'c', 'd', 'e', 'f'}}));
}

// POV-Ray's own words on a machine that is too busy.
constexpr const char* kNoThreads = "echo x >> starts; echo 'Timed out waiting for worker thread startup' >&2; exit 1";

TEST_F(PovrayTest, IsStartedAgainIfItsThreadsHadNoTimeToStart) {
  const std::string third_time =
      std::string("if [ -e starts ] && [ $(wc -l < starts) -ge 2 ]; then cat /proc/self/fd/3 > got; ") +
      kPrintTwoPixels + "; exit; fi\n" + kNoThreads;
  EXPECT_TRUE(render(third_time));
  EXPECT_EQ(read_file(folder_.path() / "got"), "the scene");
}

TEST_F(PovrayTest, IsNotStartedAgainForEver) {
  const Error error = error_of(kNoThreads);
  EXPECT_EQ(error.code, ErrorCode::kRefused);
  EXPECT_THAT(error.message, HasSubstr("worker thread startup"));
  EXPECT_EQ(read_file(folder_.path() / "starts"), "x\nx\nx\n");
}

TEST_F(PovrayTest, PassesTheSceneInMemoryAndRunsInItsFolder) {
  ASSERT_TRUE(
      render("cat /proc/self/fd/3 > got; echo $@ > arguments; env > environment\n" + std::string(kPrintTwoPixels)));
  EXPECT_EQ(read_file(folder_.path() / "got"), "the scene");
  EXPECT_THAT(read_file(folder_.path() / "arguments"),
              AllOf(HasSubstr("+I/proc/self/fd/3"), HasSubstr("+W2 +H1"), HasSubstr("-A"), HasSubstr("+WT1")));
  EXPECT_THAT(read_file(folder_.path() / "environment"),
              AllOf(HasSubstr("LC_ALL=C"), HasSubstr("POVINI=/etc/povray/3.7/povray.ini")));
}

TEST_F(PovrayTest, ThePoseIsInsertedAtItsOffset) {
  ViewTemplate view_template{.scene = "the scene", .pose_offset = 3, .width_px = 2, .height_px = 1};
  const Povray povray(folder_.script("povray", "cat /proc/self/fd/3 > got; " + std::string(kPrintTwoPixels)),
                      folder_.path() / "lab.pov", kChildLimit);
  ASSERT_TRUE(povray.render({"", std::make_shared<const ViewTemplate>(view_template), "pose"}, -1));
  EXPECT_EQ(read_file(folder_.path() / "got"), "the pose  scene");
}

TEST(PovrayArguments, FollowTheViewTemplate) {
  ViewTemplate view_template{.width_px = 20, .height_px = 10};
  EXPECT_THAT(povray_arguments(view_template), testing::IsSupersetOf({"-A", "+Q9", "+BM2", "+W20", "+H10"}));
  EXPECT_THAT(povray_arguments(view_template), testing::Not(testing::Contains(HasSubstr("+SC"))));
  view_template.antialias = 4;
  view_template.quality = 3;
  view_template.window = Window{0, 18, 2, 9};
  EXPECT_THAT(povray_arguments(view_template),
              testing::IsSupersetOf({"+A0.03", "+AM1", "+R4", "-J", "+Q3", "+EC19", "+SR3"}));
  // +SC1 would mean the whole width of the image.
  EXPECT_THAT(povray_arguments(view_template), testing::Not(testing::Contains(testing::MatchesRegex("\\+(SC|ER).*"))));
  EXPECT_THAT(povray_arguments(view_template), testing::Not(testing::Contains("-A")));
}

TEST_F(PovrayTest, ACrashNamesTheSignal) {
  const Error error = error_of("kill -SEGV $$");
  EXPECT_EQ(error.code, ErrorCode::kDisconnected);
  EXPECT_EQ(error.message, "frame 12, view lower: POV-Ray crashed (SIGSEGV)");
}

TEST_F(PovrayTest, AHangNamesFrameViewAndSeconds) {
  const Error error = error_of("sleep 1000 & wait", kChildTimeout);
  EXPECT_EQ(error.code, ErrorCode::kTimeout);
  EXPECT_EQ(error.message, "frame 12, view lower: POV-Ray did not finish within 0.3 s and was killed");
}

TEST_F(PovrayTest, ASilentFailure) {
  const Error error = error_of("exit 1");
  EXPECT_EQ(error.code, ErrorCode::kRefused);
  EXPECT_EQ(error.message, "frame 12, view lower: POV-Ray stopped with exit status 1 and no message");
}

TEST_F(PovrayTest, AnotherFailureReportsItsLastLine) {
  const Error error = error_of("echo first >&2; printf 'no more room\\n\\n' >&2; exit 9");
  EXPECT_EQ(error.code, ErrorCode::kRefused);
  EXPECT_EQ(error.message, "frame 12, view lower: POV-Ray stopped with exit status 9: no more room");
}

TEST_F(PovrayTest, AParseErrorIsOneLineWithTheScenesName) {
  const Error error = error_of(
      "printf \"File '/proc/self/fd/3' line 7: Parse Error: Expected 'numeric expression',\\n undeclared identifier "
      "'bogus' found instead\\nFatal error in parser: Cannot parse input.\\nRender failed\\n\" >&2; exit 1");
  EXPECT_EQ(error.code, ErrorCode::kRefused);
  EXPECT_EQ(error.message, scene_path() +
                               ":7: POV-Ray: Parse Error: Expected 'numeric expression', undeclared identifier 'bogus' "
                               "found instead");
}

TEST_F(PovrayTest, ATruncatedImage) {
  const Error error = error_of("printf 'P6\\n2 1\\n255\\nabc'");
  EXPECT_EQ(error.code, ErrorCode::kBadData);
  EXPECT_THAT(error.message, HasSubstr("frame 12, view lower: POV-Ray's image: 3 bytes of pixels instead of 6"));
}

TEST_F(PovrayTest, AnImageOfAnotherSize) {
  const Error error = error_of("printf 'P6\\n1 2\\n255\\nabcdef'");
  EXPECT_EQ(error.code, ErrorCode::kBadData);
  EXPECT_THAT(error.message, HasSubstr("1 x 2 pixels instead of 2 x 1"));
}

TEST_F(PovrayTest, NoImageAtAll) { EXPECT_EQ(error_of("exit 0").code, ErrorCode::kBadData); }

TEST_F(PovrayTest, AHundredMegabytesOfMessages) {
  const Error error = error_of("head -c 100000000 /dev/zero | tr '\\0' x >&2; echo >&2; echo the end >&2; exit 1");
  EXPECT_EQ(error.code, ErrorCode::kRefused);
  EXPECT_THAT(error.message, testing::EndsWith("the end"));
}

TEST_F(PovrayTest, AFloodOnStandardOutput) {
  const Error error = error_of("cat /dev/zero");
  EXPECT_EQ(error.code, ErrorCode::kBadData);
  EXPECT_THAT(error.message, HasSubstr("more than an image of 2 x 1 pixels"));
}

TEST_F(PovrayTest, AMissingProgramIsReported) {
  const Povray povray((folder_.path() / "gone").string(), folder_.path() / "lab.pov", kChildLimit);
  EXPECT_THAT(povray.render(plain_image("frame 12, view lower", "", 2, 1, 1), -1),
              FailsWith(ErrorCode::kUnavailable, HasSubstr("No such file or directory")));
}

// ---- finding the program

TEST(FindPovray, InPathOrAtAGivenPath) {
  const TemporaryFolder folder;
  const std::string program = folder.script("tracer", "");
  EXPECT_EQ(find_povray(program).value(), program);
  const char* path = ::getenv("PATH");
  ASSERT_NE(path, nullptr);
  const std::string old_path = path;
  ::setenv("PATH", ("/nowhere:" + folder.path().string()).c_str(), 1);
  const auto found = find_povray("tracer");
  const auto missing = find_povray("sh");
  ::setenv("PATH", old_path.c_str(), 1);
  ASSERT_TRUE(found);
  EXPECT_EQ(*found, program);
  ASSERT_THAT(missing, FailsWith(ErrorCode::kUnavailable));
}

TEST(FindPovray, AFileThatIsNoProgramIsRefused) {
  const TemporaryFolder folder;
  EXPECT_THAT(find_povray(folder.write("tracer", "text").string()), FailsWith(ErrorCode::kUnavailable));
  EXPECT_FALSE(find_povray(folder.path().string())) << "a folder is executable, but no program";
}

// ---- the image's format

TEST(ParsePpm, HeadersOfEveryKind) {
  for (const char* header : {"P6\n2 1\n255\n", "P6 2 1 255 ", "P6\n# a comment 9 9\n2\n# another\n\n1\t255\r"}) {
    const auto image = parse_ppm(std::string(header) + "abcdef");
    ASSERT_TRUE(image) << header << ": " << image.error().message;
    EXPECT_EQ(image->bytes, (std::vector<std::uint8_t>{'a', 'b', 'c', 'd', 'e', 'f'})) << header;
  }
}

TEST(ParsePpm, RefusesIncompleteImages) {
  for (const char* bytes :
       {"", "P6", "P6\n2", "P6\n2 1\n255", "P6\n2 1\n255\nabcde", "P6\n2 1\n255\nabcdefg", "P5\n2 1\n255\nab",
        "P6\n-2 1\n255\nabcdef", "P6\n2 0\n255\n", "P6\n2 1\n65535\nabcdefabcdef", "P6\n2 x\n255\nabcdef",
        "P6\n# no end", "P6\n99999999999 1\n255\nabcdef", "P6\n2 1\n255abcdef"}) {
    EXPECT_THAT(parse_ppm(bytes), FailsWith(ErrorCode::kBadData)) << bytes;
  }
}

// ---- POV-Ray's messages, as 3.7.0.10 prints them

struct MessageCase {
  const char* errors;
  const char* complaint;
};

TEST(PovrayComplaint, IsOneLine) {
  for (
      const MessageCase& c : std::vector<MessageCase>{
          {"", ""},
          {"povray: cannot open the user configuration file /x/povray.conf: No such file or directory\n", ""},
          {"File '/proc/self/fd/3' line 6: Parse Error: No matching } in 'sphere', End of\n File found instead\n"
           "Fatal error in parser: Cannot parse input.\nRender failed\n",
           "lab.pov:6: POV-Ray: Parse Error: No matching } in 'sphere', End of File found instead"},
          {"File '/proc/self/fd/3' line 3: Parse Warning: Camera location to look_at\n direction and sky.\n"
           "File 'parts.inc' line 2: Parse Error: Array subscript out of range\nFatal error in parser: Cannot parse "
           "input.\n",
           "parts.inc:2: POV-Ray: Parse Error: Array subscript out of range"},
          {"File '/a/very/long/name/of/an/include/file/that/does/not/fit/into/eighty/colu\nmns.inc' line 2: Parse "
           "Error: "
           "No\nFatal error in parser: Cannot parse input.\n",
           "/a/very/long/name/of/an/include/file/that/does/not/fit/into/eighty/columns.inc:2: POV-Ray: Parse Error: "
           "No"},
          {"File '/proc/self/fd/3' line 5: Possible Parse Error: Cannot find file\n 'nofile.png', even after trying to "
           "append file type extension.\nFile '/proc/self/fd/3' line 5: Possible Parse Error: Cannot find image file.\n"
           "Fatal error in parser: Cannot open file.\nRender failed\n",
           "lab.pov:5: POV-Ray: Possible Parse Error: Cannot find file 'nofile.png', even after trying to append file "
           "type "
           "extension."},
          {"File '/proc/self/fd/3' line 2: Possible Parse Error: All #version and #declares\n of float require "
           "semi-colon ';' at end.\nFatal error in renderer: Out of memory.\n",
           "lab.pov: POV-Ray: Fatal error in renderer: Out of memory."},
          {"File '/proc/self/fd/3' line 7: Possible Parse Error: No normal type given.\nFatal error in parser: "
           "Uncategorized error.\nRender failed\n",
           "lab.pov:7: POV-Ray: Possible Parse Error: No normal type given."},
          {"==== [Parsing...] =====\nFatal error in renderer: Out of memory.\nRender failed\n",
           "lab.pov: POV-Ray: Fatal error in renderer: Out of memory."},
      }) {
    EXPECT_EQ(povray_complaint(c.errors, "lab.pov"), c.complaint) << c.errors;
  }
}

}  // namespace
}  // namespace twocone::sim_povray

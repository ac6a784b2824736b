// SPDX-License-Identifier: Apache-2.0
#include "base/log.h"

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace twocone::base {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::Not;

constexpr Logger kLog("part");
constexpr Logger kOtherLog("other");

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Log : public testing::Test {
 protected:
  void SetUp() override { static_cast<void>(close_log()); }
  void TearDown() override { static_cast<void>(close_log()); }

  const testing_support::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "run.log";
};

TEST_F(Log, KeepsMessagesUntilItsFileOpens) {
  kLog.warning("came early");
  open_log(file_);
  kLog.error("came late");
  // It is there at once, for whoever kills the program now.
  EXPECT_THAT(text_of(file_), MatchesRegex("[-0-9]+T[0-9:.]+[-+][0-9:]+ warning part: came early\n"
                                           "[-0-9]+T[0-9:.]+[-+][0-9:]+ error part: came late\n"));
  EXPECT_THAT(close_log(), IsEmpty()) << "what is in the file is reported as unseen";
  kLog.warning("came after the run");
  EXPECT_THAT(text_of(file_), Not(HasSubstr("after the run")));
}

TEST_F(Log, OfAResumedRunIsAppended) {
  std::ofstream(file_) << "an old line\n";
  open_log(file_);
  kLog.warning("a new one");
  EXPECT_THAT(text_of(file_), MatchesRegex("an old line\n.* part: a new one\n"));
}

TEST_F(Log, ReturnsOnceWhatNoOneHasSeen) {
  kLog.warning("lost with its folder");
  EXPECT_THAT(close_log(), ElementsAre(EndsWith("warning part: lost with its folder")));
  EXPECT_THAT(close_log(), IsEmpty());
}

TEST_F(Log, HoldsWarningsAndErrorsOnly) {
  kLog.debug("a step");
  kLog.info("a change");
  kLog.warning("a handled failure");
  kLog.error("a failure");
  EXPECT_THAT(close_log(), ElementsAre(EndsWith("a handled failure"), EndsWith("a failure")));
}

TEST_F(Log, WritesAnEqualMessageOncePerSecondWithTheNumberOfOthers) {
  // As many as the test's machine writes within 0.9 s, however slow it is.
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 3; ++i) kLog.warning("again");
  kOtherLog.warning("again");
  if (std::chrono::steady_clock::now() - begin > 900ms) GTEST_SKIP() << "the machine stood still";
  std::this_thread::sleep_until(begin + 1100ms);
  kLog.warning("again");
  EXPECT_THAT(close_log(), ElementsAre(EndsWith("part: again"), EndsWith("other: again"),
                                       EndsWith("part: again (2 times more since the last such line)")));
}

// Catches a limit that forgets nothing: its memory would grow with each message that differs.
TEST_F(Log, KeepsTheLastThousandMessages) {
  for (int i = 0; i < 1100; ++i) kLog.warning("message " + std::to_string(i));
  const auto kept = close_log();
  ASSERT_EQ(kept.size(), 1000U);
  EXPECT_THAT(kept.front(), EndsWith("message 100"));
  EXPECT_THAT(kept.back(), EndsWith("message 1099"));
}

// Catches a log that ends the run which it reports.
TEST_F(Log, OutlivesADiskThatTakesNothing) {
  open_log(folder_.path());  // is no file
  kLog.warning("kept");
  EXPECT_THAT(close_log(), ElementsAre(EndsWith("kept")));
  open_log("/dev/full");
  kLog.warning("lost");
  kLog.warning("lost, too");
}

// In a child, because nothing hides a log again that was shown.
TEST(LogDeathTest, IsShownOnStandardErrorFromItsLevelOn) {
  const auto say_all = [](const char* level) {
    show_log(level);
    kLog.debug("a step");
    kLog.error("a failure");
    std::_Exit(close_log().empty() ? 0 : 1);
  };
  EXPECT_EXIT(say_all("debug"), testing::ExitedWithCode(0), "debug part: a step\n.*error part: a failure\n");
  EXPECT_EXIT(say_all("error"), testing::ExitedWithCode(0), AllOf(HasSubstr("a failure"), Not(HasSubstr("a step"))));
  EXPECT_EXIT(say_all("off"), testing::ExitedWithCode(0), "^$");
}

}  // namespace
}  // namespace twocone::base

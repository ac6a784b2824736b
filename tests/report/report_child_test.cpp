// SPDX-License-Identifier: Apache-2.0
#include "apps/report/figures/child.h"

#include <signal.h>

#include <cerrno>
#include <chrono>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/report/synthetic_run.h"

namespace twocone::report {
namespace {

using namespace std::chrono_literals;

/// Far more time than a shell needs to start, far less than the sleeps below.
constexpr auto kPatience = 10s;

Result<ProgramOutput> shell(const std::string& commands, std::chrono::milliseconds timeout = kPatience) {
  return run_program("sh", {"-c", commands}, timeout);
}

TEST(RunProgram, GivesOutputErrorsAndExitCode) {
  const auto output = shell("echo out; echo err >&2; exit 3");
  ASSERT_TRUE(output) << output.error().message;
  EXPECT_EQ(output->out, "out\n");
  EXPECT_EQ(output->err, "err\n");
  EXPECT_EQ(output->exit_code, 3);
}

TEST(RunProgram, PassesArgumentsAsTheyAre) {
  const auto output = run_program("printf", {"%s|", "a b", "$(id)", "", "'\""}, kPatience);
  ASSERT_TRUE(output) << output.error().message;
  EXPECT_EQ(output->out, "a b|$(id)||'\"|");
}

TEST(RunProgram, GivesTheProgramAnEmptyInput) {
  const auto output = run_program("cat", {}, kPatience);
  ASSERT_TRUE(output) << output.error().message;
  EXPECT_EQ(output->out, "");
}

TEST(RunProgram, ReportsWhatCannotBeStarted) {
  const auto output = run_program("/no/such/program", {}, kPatience);
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().code, ErrorCode::kUnavailable);
  EXPECT_NE(output.error().message.find("/no/such/program"), std::string::npos) << output.error().message;
}

// Catches reading one pipe to its end before the other: the child would wait forever on the full one.
TEST(RunProgram, ReadsBothPipesAtOnce) {
  constexpr std::size_t kMuch = 1U << 20U;  // a pipe holds 64 KiB
  const auto output = shell("head -c 1048576 /dev/zero >&2; head -c 1048576 /dev/zero");
  ASSERT_TRUE(output) << output.error().message;
  EXPECT_EQ(output->out.size(), kMuch);
  EXPECT_EQ(output->err.size(), kMuch);
}

/// The number that a child wrote into `file`.
pid_t pid_in(const std::filesystem::path& file) {
  pid_t pid = 0;
  std::ifstream(file) >> pid;
  return pid;
}

// Catches a child that outlives its deadline, or is left as a zombie: kill() finds both.
TEST(RunProgram, KillsAndReapsAProgramThatDoesNotEnd) {
  const ScratchFolder scratch;
  const auto file = scratch.path() / "pid";
  for (const std::string& ending : {std::string("exec sleep 60"), std::string("exec >&- 2>&-; exec sleep 60")}) {
    const auto begun = std::chrono::steady_clock::now();
    const auto output = shell("echo $$ > " + file.string() + "; " + ending, 1000ms);
    ASSERT_FALSE(output) << ending;
    EXPECT_EQ(output.error().code, ErrorCode::kTimeout) << output.error().message;
    EXPECT_LT(std::chrono::steady_clock::now() - begun, kPatience) << ending;
    const pid_t pid = pid_in(file);
    ASSERT_GT(pid, 1) << ending;
    EXPECT_EQ(::kill(pid, 0), -1) << ending;
    EXPECT_EQ(errno, ESRCH) << ending;
  }
}

TEST(RunProgram, NamesTheSignalThatEndedIt) {
  const auto output = shell("kill -TERM $$");
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().code, ErrorCode::kDisconnected);
  EXPECT_NE(output.error().message.find("signal 15"), std::string::npos) << output.error().message;
}

TEST(RunProgram, StopsAProgramThatWritesWithoutEnd) {
  const auto output = run_program("yes", {}, 60s);
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().code, ErrorCode::kBadData) << output.error().message;
}

}  // namespace
}  // namespace twocone::report

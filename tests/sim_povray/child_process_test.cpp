// SPDX-License-Identifier: Apache-2.0
#include "base/child_process.h"

#include <fcntl.h>
#include <sys/wait.h>

#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sim_povray/test_support.h"

namespace twocone::sim_povray {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using End = base::ChildResult::End;

class ChildProcessTest : public testing::Test {
 protected:
  [[nodiscard]] base::ChildRequest request(const std::string& commands) const {
    base::ChildRequest r;
    r.program.path = folder_.script("child", commands);
    r.program.environment = {"PATH=/usr/bin:/bin", "GREETING=hello"};
    r.program.folder = folder_.path().string();
    r.max_output = 1'000'000;
    r.timeout = kChildLimit;
    return r;
  }

  /// The process whose number a script wrote to the file `pid`.
  [[nodiscard]] pid_t noted_pid() const { return pid_t(std::stol(read_file(folder_.path() / "pid"))); }

  void TearDown() override { EXPECT_TRUE(children_of(::getpid()).empty()) << "a child was not reaped"; }

  TemporaryFolder folder_;
};

TEST_F(ChildProcessTest, ReturnsTheOutputOfTheChild) {
  auto r = request("echo \"$GREETING $1 $HOME\"; pwd; echo no >&2; exit 3");
  r.program.arguments = {"a b"};
  const base::ChildResult result = base::run_child(r);
  EXPECT_EQ(result.end, End::kEnded);
  EXPECT_EQ(WEXITSTATUS(result.wait_status), 3);
  EXPECT_EQ(result.output, "hello a b \n" + std::filesystem::canonical(folder_.path()).string() + "\n");
  EXPECT_EQ(result.errors, "no\n");
}

TEST_F(ChildProcessTest, PassesArgumentsAsTheyAre) {
  auto r = request("printf '%s|' \"$@\"");
  r.program.arguments = {"a b", "$(id)", "", "'\""};
  EXPECT_EQ(base::run_child(r).output, "a b|$(id)||'\"|");
}

// Catches reading one pipe to its end before the other: the child would wait forever on the full one.
TEST_F(ChildProcessTest, ReadsBothPipesAtOnce) {
  constexpr std::size_t kMuch = 1U << 20U;  // a pipe holds 64 KiB
  auto r = request("head -c 1048576 /dev/zero >&2; head -c 1048576 /dev/zero");
  r.max_output = kMuch;
  const base::ChildResult result = base::run_child(r);
  EXPECT_EQ(result.end, End::kEnded);
  EXPECT_EQ(result.output.size(), kMuch);
  EXPECT_EQ(result.errors.size(), base::kMaxErrors);
}

// Catches waiting for the ends of the pipes instead of the end of the child.
TEST_F(ChildProcessTest, KillsAChildThatHasClosedItsPipes) {
  auto r = request("exec >&- 2>&-; exec sleep 1000");
  r.timeout = kChildTimeout;
  EXPECT_EQ(base::run_child(r).end, End::kTimedOut);
}

TEST_F(ChildProcessTest, FindsProgramsByPath) {
  const auto shell = base::find_program("sh");
  ASSERT_TRUE(shell);
  EXPECT_THAT(*shell, testing::EndsWith("/sh"));
  EXPECT_EQ(base::find_program("./sh"), "./sh");
  EXPECT_EQ(base::find_program("no-such-program"), std::nullopt);
}

// Catches an open descriptor that leaks into the child: two renderings at once would hold each other's pipes open.
TEST_F(ChildProcessTest, TheChildHasItsInputAndNothingElse) {
  // This descriptor has no close-on-exec flag, and its number is above those that the child gets.
  const base::UniqueFd zero(::open("/dev/zero", O_RDONLY));
  const base::UniqueFd leaked(::fcntl(zero.get(), F_DUPFD, 50));
  const base::UniqueFd input = base::memory_file("input", "from memory");
  auto r = request("cat; cat /proc/self/fd/3; for f in /proc/$$/fd/*; do echo; readlink $f; done");
  r.program.inputs = {input.get()};
  const base::ChildResult result = base::run_child(r);
  EXPECT_THAT(result.output, testing::StartsWith("from memory")) << "standard input is empty";
  EXPECT_THAT(result.output, testing::Not(HasSubstr("/dev/zero")));
}

TEST_F(ChildProcessTest, ReportsASignal) {
  const base::ChildResult result = base::run_child(request("kill -SEGV $$"));
  EXPECT_EQ(result.end, End::kEnded);
  EXPECT_TRUE(WIFSIGNALED(result.wait_status) && WTERMSIG(result.wait_status) == SIGSEGV) << result.wait_status;
}

// Catches a kill that ends the child but not the processes that it started.
TEST_F(ChildProcessTest, KillsTheWholeGroupAfterTheTimeout) {
  auto r = request("sleep 1000 & echo $! > pid; wait");
  r.timeout = kChildTimeout;
  const auto begin = std::chrono::steady_clock::now();
  const base::ChildResult result = base::run_child(r);
  const auto took = std::chrono::steady_clock::now() - begin;
  EXPECT_EQ(result.end, End::kTimedOut);
  EXPECT_GE(took, kChildTimeout);
  EXPECT_LT(took, kChildLimit);
  EXPECT_TRUE(eventually([&] { return !is_running(noted_pid()); }));
}

TEST_F(ChildProcessTest, KillsAChildThatIgnoresPoliteSignals) {
  auto r = request("trap '' TERM INT HUP; while :; do :; done");
  r.timeout = kChildTimeout;
  EXPECT_EQ(base::run_child(r).end, End::kTimedOut);
}

// Catches a deadline that is only checked while the child is silent.
TEST_F(ChildProcessTest, AChattyChildIsKilledInTimeToo) {
  auto r = request("while :; do echo nonsense >&2; done");
  r.timeout = kChildTimeout;
  const base::ChildResult result = base::run_child(r);
  EXPECT_EQ(result.end, End::kTimedOut);
  EXPECT_LE(result.errors.size(), base::kMaxErrors);
}

// Catches waiting for the end of a pipe that another process still holds open.
TEST_F(ChildProcessTest, DoesNotWaitForProcessesThatTheChildLeaves) {
  const auto begin = std::chrono::steady_clock::now();
  const base::ChildResult result = base::run_child(request("sleep 1000 & echo $! > pid; echo done"));
  EXPECT_EQ(result.end, End::kEnded);
  EXPECT_EQ(result.output, "done\n");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kChildLimit);
  EXPECT_TRUE(eventually([&] { return !is_running(noted_pid()); }));
}

TEST_F(ChildProcessTest, DoesNotReadFromProcessesThatTheChildLeaves) {
  const auto begin = std::chrono::steady_clock::now();
  const base::ChildResult result = base::run_child(request("for i in 1 2 3; do cat /dev/zero >&2 & done; echo done"));
  EXPECT_EQ(result.end, End::kEnded);
  EXPECT_EQ(result.output, "done\n");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kChildLimit / 2);
}

TEST_F(ChildProcessTest, KeepsTheNewestOfALotOfErrors) {
  const base::ChildResult result =
      base::run_child(request("head -c 100000000 /dev/zero | tr '\\0' x >&2; echo the end >&2"));
  EXPECT_EQ(result.end, End::kEnded);
  EXPECT_EQ(result.errors.size(), base::kMaxErrors);
  EXPECT_THAT(result.errors, testing::EndsWith("xthe end\n"));
}

TEST_F(ChildProcessTest, KillsAChildThatWritesTooMuch) {
  auto r = request("cat /dev/zero");
  r.max_output = 200'000;
  const base::ChildResult result = base::run_child(r);
  EXPECT_EQ(result.end, End::kTooMuch);
  EXPECT_LT(result.output.size(), 400'000U) << "and stores no more than it must";
}

TEST_F(ChildProcessTest, TakesAsMuchAsIsAllowed) {
  auto r = request("head -c 1000000 /dev/zero");
  const base::ChildResult result = base::run_child(r);
  EXPECT_EQ(result.end, End::kEnded);
  EXPECT_EQ(result.output.size(), 1'000'000U);
}

TEST_F(ChildProcessTest, StopsOnRequest) {
  base::StopSignal stop;
  auto r = request("touch started; exec sleep 1000");
  r.stop_fd = stop.fd();
  std::thread other([&] {
    (void)eventually([&] { return std::filesystem::exists(folder_.path() / "started"); });
    stop.raise();
  });
  const base::ChildResult result = base::run_child(r);
  other.join();
  EXPECT_EQ(result.end, End::kStopped);
}

TEST_F(ChildProcessTest, ReportsWhyItCouldNotStart) {
  auto r = request("");
  r.program.path = (folder_.path() / "none").string();
  const base::ChildResult missing = base::run_child(r);
  EXPECT_EQ(missing.end, End::kNotStarted);
  EXPECT_EQ(missing.errors, "starting the program: No such file or directory");

  r = request("");
  r.program.folder = (folder_.path() / "none").string();
  const base::ChildResult nowhere = base::run_child(r);
  EXPECT_EQ(nowhere.end, End::kNotStarted);
  EXPECT_EQ(nowhere.errors, "entering the folder: No such file or directory");
}

// This is why kill -9 of the program leaves no POV-Ray process: the kernel kills the child with the thread that waits
// for it.
TEST_F(ChildProcessTest, TheChildDiesWithItsParent) {
  const auto r = request("echo $$ > pid.new; mv pid.new pid; exec sleep 1000");
  const pid_t parent = ::fork();
  ASSERT_GE(parent, 0);
  if (parent == 0) {
    (void)base::run_child(r);
    ::_exit(0);
  }
  const bool started = eventually([&] { return std::filesystem::exists(folder_.path() / "pid"); });
  ::kill(parent, SIGKILL);
  ::waitpid(parent, nullptr, 0);
  ASSERT_TRUE(started);
  EXPECT_TRUE(eventually([&] { return !is_running(noted_pid()); }));
}

}  // namespace
}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/work.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <set>
#include <stdexcept>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace twocone::tradeoff {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using Progress = std::function<void(double)>;

// Far more than the fake work takes, also on a loaded machine under a sanitizer: it only ends a test that hangs.
constexpr auto kLong = 30s;
constexpr auto kNap = 5ms;

/// Runs fake shards: each writes a file that names its process.
class WorkTest : public testing::Test {
 protected:
  using Fake = std::function<Status(std::size_t shard, const Progress& progress, const std::atomic<bool>& stop)>;

  Result<std::size_t> run(const std::vector<Piece>& pieces, const Fake& fake) {
    return run_in_children(
        pieces, options_, [&](const Notify&) -> DoShard { return fake; }, stop_);
  }
  void TearDown() override {
    EXPECT_TRUE(::waitpid(-1, nullptr, WNOHANG) < 0 && errno == ECHILD) << "a child was not reaped";
  }

  void note(std::size_t shard, const std::string& text) const {
    std::ofstream(folder_.path() / std::to_string(shard)) << text;
  }
  void put_away(std::size_t shard) const { note(shard, std::to_string(::getpid())); }
  [[nodiscard]] std::string noted(std::size_t shard) const { return folder_.read(std::to_string(shard)); }
  [[nodiscard]] static std::vector<Piece> pieces(std::size_t count, std::size_t kinds = 1) {
    std::vector<Piece> all;
    for (std::size_t i = 0; i < count; ++i) all.push_back({.shard = i, .kind = i % kinds});
    return all;
  }

  testing_support::TemporaryFolder folder_;
  WorkOptions options_{.jobs = 3, .silence = kLong, .patience = kLong};
  std::atomic<bool> stop_{false};
};

TEST_F(WorkTest, AllShardsAreDoneByOtherProcesses) {
  double last = 0;
  options_.progress = [&](double share) {
    EXPECT_GE(share, last) << "progress decreases";
    last = share;
  };
  const auto done =
      run(pieces(20), [&](std::size_t shard, const Progress& progress, const std::atomic<bool>&) -> Status {
        progress(0.5);
        std::this_thread::sleep_for(kNap);
        put_away(shard);
        return {};
      });
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(*done, 20U);
  EXPECT_DOUBLE_EQ(last, 1);
  std::set<std::string> processes;
  for (std::size_t i = 0; i < 20; ++i) processes.insert(noted(i));
  EXPECT_EQ(processes.size(), 3U);
  EXPECT_EQ(processes.count(std::to_string(::getpid())), 0U) << "work was done in the caller's own process";
  EXPECT_EQ(processes.count(""), 0U) << "a shard was not done";
}

TEST_F(WorkTest, WithoutPiecesTheWorkIsFinished) {
  const auto done = run({}, [](std::size_t, const Progress&, const std::atomic<bool>&) -> Status { std::abort(); });
  ASSERT_TRUE(done);
  EXPECT_EQ(*done, 0U);
}

// Catches pieces distributed in turn: each process would start the renderer for each kind. Nothing here depends on
// which process is quicker: shard 0 ends only after the other two kinds have continued, and no process is idle before
// the last piece is given out.
TEST_F(WorkTest, AProcessContinuesWithItsKind) {
  const auto wait_for = [&](int seconds_dealt) {
    const auto until = std::chrono::steady_clock::now() + kLong;
    const auto dealt = [&] { return !noted(3).empty() + !noted(4).empty() + !noted(5).empty(); };
    while (dealt() < seconds_dealt && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(kNap);
  };
  const auto done = run(pieces(6, 3), [&](std::size_t shard, const Progress&, const std::atomic<bool>&) -> Status {
    put_away(shard);
    if (shard == 0) wait_for(2);
    if (shard >= 3) wait_for(3);
    return {};
  });
  ASSERT_TRUE(done);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(noted(i), noted(i + 3)) << "kind " << i;
}

TEST_F(WorkTest, AFailureIsReportedWithItsShardAndTheOthersFinishTheirs) {
  const auto done = run(pieces(100), [&](std::size_t shard, const Progress&, const std::atomic<bool>&) -> Status {
    if (shard == 4) return Error{ErrorCode::kBadData, "no image came"};
    std::this_thread::sleep_for(kNap);
    put_away(shard);
    return {};
  });
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::kBadData);
  EXPECT_EQ(done.error().message, "shard 4: no image came");
  EXPECT_EQ(noted(99), "") << "shards were given out after the failure";
}

TEST_F(WorkTest, AnExceptionIsAFailure) {
  const auto done = run(pieces(1), [](std::size_t, const Progress&, const std::atomic<bool>&) -> Status {
    throw std::runtime_error("the disk is full");
  });
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "shard 0: the disk is full");
}

TEST_F(WorkTest, AKilledProcessIsReportedWithItsShard) {
  const auto done = run(pieces(6), [&](std::size_t shard, const Progress&, const std::atomic<bool>&) -> Status {
    if (shard == 5) ::raise(SIGKILL);
    put_away(shard);
    return {};
  });
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::kDisconnected);
  EXPECT_THAT(done.error().message, AllOf(HasSubstr("shard 5: "), HasSubstr("killed by signal 9")));
  EXPECT_NE(noted(0), "");
}

// A grandchild keeps the socket open, as POV-Ray's janitor does; the death must be noticed nevertheless.
TEST_F(WorkTest, ADeathIsNoticedThoughTheSocketStaysOpen) {
  const auto done = run(pieces(1), [&](std::size_t shard, const Progress&, const std::atomic<bool>&) -> Status {
    const pid_t grandchild = ::fork();
    if (grandchild == 0) {
      ::pause();
      ::_exit(0);
    }
    note(shard, std::to_string(grandchild));
    ::_exit(3);
  });
  ::kill(pid_t(std::stol(noted(0))), SIGKILL);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "shard 0: its process ended by itself with status 3");
}

TEST_F(WorkTest, ASilentProcessIsKilled) {
  options_.silence = 300ms;
  const auto done = run(pieces(1), [](std::size_t, const Progress&, const std::atomic<bool>&) -> Status {
    std::this_thread::sleep_for(kLong);
    return {};
  });
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "shard 0: its process was silent for 0.3 s and was killed");
}

TEST_F(WorkTest, StopEndsThePresentShardsAndIsNotAFailure) {
  // Set when each process has begun a shard; a shard that has not begun by then never does.
  const double all_begun = 0.5 * options_.jobs / 50;
  options_.progress = [&](double share) {
    if (share > 0.99 * all_begun) stop_ = true;
  };
  const auto done =
      run(pieces(50), [&](std::size_t shard, const Progress& progress, const std::atomic<bool>& stop) -> Status {
        progress(0.5);
        while (!stop) std::this_thread::sleep_for(kNap);
        note(shard, "stopped");
        return Error{ErrorCode::kRefused, "stopped"};
      });
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(*done, 0U);
  EXPECT_EQ(noted(0), "stopped") << "the process was not allowed to end";
  EXPECT_EQ(noted(10), "");
}

TEST_F(WorkTest, AProcessThatDoesNotStopIsKilled) {
  options_.patience = 200ms;
  stop_ = false;
  options_.progress = [&](double share) { stop_ = share > 0; };
  const auto done = run(pieces(1), [](std::size_t, const Progress& progress, const std::atomic<bool>&) -> Status {
    progress(0.5);
    std::this_thread::sleep_for(kLong);
    return {};
  });
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(*done, 0U);
}

TEST_F(WorkTest, LinesAreReportedAndTheWorkIsDestroyed) {
  struct Holder {
    Notify notify;
    ~Holder() { notify("destroyed"); }
  };
  std::vector<std::string> reported;
  options_.jobs = 1;
  options_.tell = [&](const std::string& line) { reported.push_back(line); };
  const auto start = [](const Notify& notify) -> DoShard {
    notify("started");
    auto holder = std::make_shared<Holder>(Holder{notify});
    return [holder](std::size_t, const Progress&, const std::atomic<bool>&) -> Status { return {}; };
  };
  ASSERT_TRUE(run_in_children(pieces(2), options_, start, stop_));
  ASSERT_GE(reported.size(), 2U);
  EXPECT_EQ(reported.front(), "started");
  EXPECT_EQ(reported.back(), "destroyed");
}

// Catches children that outlive a killed parent.
TEST_F(WorkTest, ChildrenDieWithTheirParent) {
  const pid_t parent = ::fork();
  if (parent == 0) {
    options_.jobs = 1;
    const auto ignored = run(pieces(1), [&](std::size_t shard, const Progress&, const std::atomic<bool>&) -> Status {
      put_away(shard);
      std::this_thread::sleep_for(kLong);
      return {};
    });
    ::_exit(ignored ? 0 : 1);
  }
  const auto until = std::chrono::steady_clock::now() + kLong;
  while (noted(0).empty() && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(kNap);
  ASSERT_NE(noted(0), "");
  const auto child = pid_t(std::stol(noted(0)));
  ::kill(parent, SIGKILL);
  ASSERT_EQ(::waitpid(parent, nullptr, 0), parent);
  // Its new parent may leave it a zombie, which also is dead.
  const auto alive = [&] {
    std::ifstream file("/proc/" + std::to_string(child) + "/stat");
    std::string pid, name, state;
    return bool(file >> pid >> name >> state) && state != "Z" && state != "X";
  };
  while (alive() && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(kNap);
  EXPECT_FALSE(alive());
}

}  // namespace
}  // namespace twocone::tradeoff

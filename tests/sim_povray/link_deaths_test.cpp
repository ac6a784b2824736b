// SPDX-License-Identifier: Apache-2.0
// Programs that are killed or stopped at one end of the link, and who notices.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <iterator>
#include <random>
#include <thread>

#include "tests/sim_povray/link_client.h"

extern char** environ;

namespace twocone::sim_povray {
namespace {

using std::chrono::milliseconds;
using testing::Contains;

/// A link_peer, killed and reaped with this object.
class PeerProcess {
 public:
  explicit PeerProcess(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), TWOCONE_LINK_PEER);
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    EXPECT_EQ(::posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), environ), 0);
    ::posix_spawn_file_actions_destroy(&actions);
  }
  ~PeerProcess() { kill(); }
  PeerProcess(const PeerProcess&) = delete;
  PeerProcess& operator=(const PeerProcess&) = delete;

  void signal(int number) { ::kill(pid_, number); }
  void kill() {
    if (pid_ == 0) return;
    signal(SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

 private:
  pid_t pid_ = 0;
};

std::ptrdiff_t open_files() {
  const std::filesystem::directory_iterator files("/proc/self/fd");
  return std::distance(begin(files), end(files));
}

class LinkDeaths : public Link {};

TEST_F(LinkDeaths, AKilledClientIsMissedByNobody) {
  TestServer server("hall");
  auto survivor = take("1");
  ASSERT_TRUE(survivor);
  open_views(*survivor);
  const auto files_before = open_files();
  std::mt19937_64 random(4711);
  constexpr int kTimes = 20;
  int attached = 0;
  for (int i = 0; i < kTimes; ++i) {
    PeerProcess client({"drive", "hall", "2"});
    // Half of them at any moment from their start on, half of them at work for sure.
    if (i % 2 == 0) {
      ASSERT_TRUE(eventually([&] { return server.hall().seats() == 2; }));
    }
    const auto life = in(milliseconds(random() % 40));
    while (std::chrono::steady_clock::now() < life) {
      const Status together = survivor->step(life);
      EXPECT_TRUE(together || together.error().code == ErrorCode::kTimeout) << together.error().message;
    }
    attached += server.hall().seats() == 2 ? 1 : 0;
    client.kill();
    const Status alone = survivor->step(in(kNoticed));
    EXPECT_TRUE(alone) << "after client " << i << ": " << alone.error().message;
    ASSERT_TRUE(eventually([&] { return server.hall().seats() == 1; }));
    expect_picture(survivor->picture(0), fake_picture("1", 0, survivor->state().tick, kSize));
  }
  EXPECT_GE(attached, kTimes / 2);
  EXPECT_TRUE(eventually([&] { return open_files() <= files_before; })) << open_files() << " of " << files_before;
  EXPECT_THAT(server.lines(), Contains("robot.2 left: the program ended"));
}

TEST_F(LinkDeaths, AClientThatDiesInALongStepIsMissedAtOnce) {
  TestServer server("hall");
  auto other = take("1");  // never asks, so that the step below cannot end
  ASSERT_TRUE(other);
  {
    RawClient client;
    client.sit("2");
    client.say(link::Step{std::chrono::minutes(1)});
    ASSERT_TRUE(eventually([&] { return server.hall().robot("2").asks; }));
  }
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(eventually([&] { return server.hall().seats() == 1; }));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kNoticed);
  EXPECT_TRUE(other->step(in(kPatience)));
}

TEST_F(LinkDeaths, AKilledServerIsNoticedAndItsNameIsFree) {
  std::mt19937_64 random(4712);
  for (int i = 0; i < 5; ++i) {
    PeerProcess server({"serve", "hall"});
    auto one = take("1");
    auto two = take("2");
    ASSERT_TRUE(one && two);
    open_views(*one);
    std::vector<std::shared_future<ImageResult>> pictures;
    SteadyTime killed;
    std::thread killer([&, life = in(milliseconds(random() % 60))] {
      std::this_thread::sleep_until(life);
      server.signal(SIGKILL);
      killed = std::chrono::steady_clock::now();
    });
    // The other robot never asks: this one waits when it happens.
    EXPECT_EQ(one->step(in(kPatience)).error().code, ErrorCode::kDisconnected);
    const auto noticed = std::chrono::steady_clock::now();
    killer.join();
    EXPECT_LT(noticed - killed, kNoticed);
    for (int p = 0; p < 4; ++p) expect_disconnected(one->picture(0));
    EXPECT_EQ(two->command({1, 1}).error().code, ErrorCode::kDisconnected);
    EXPECT_EQ(two->open_view({"lower", 1, {}}).error().code, ErrorCode::kDisconnected);
    EXPECT_TRUE(eventually([&] { return runtime_.files().empty(); })) << "something is left in the runtime folder";
  }
}

TEST_F(LinkDeaths, PicturesOnTheirWayEndWithAKilledServer) {
  PeerProcess server({"serve", "hall"});
  auto seat = take("1");
  ASSERT_TRUE(seat);
  open_views(*seat);
  std::vector<std::shared_future<ImageResult>> pictures;
  for (int i = 0; i < 5; ++i) pictures.push_back(seat->picture(0));
  server.kill();
  for (const auto& picture : pictures) {
    ASSERT_EQ(picture.wait_for(kNoticed), std::future_status::ready);
    EXPECT_TRUE(picture.get() || picture.get().error().code == ErrorCode::kDisconnected);
  }
}

TEST_F(LinkDeaths, AStaleSocketIsTakenOver) {
  {
    PeerProcess server({"serve", "hall"});
    ASSERT_TRUE(eventually([&] { return runtime_.files().size() == 2; }));
  }
  EXPECT_EQ(runtime_.files().size(), 2u) << "kill -9 with no client to sweep: this is the case meant here";
  TestServer next("hall");
  EXPECT_TRUE(take("1"));
}

TEST_F(LinkDeaths, AServerThatIsStoppedInItsTracksIsGivenUp) {
  PeerProcess server({"serve", "hall"});
  auto seat = take("1");
  ASSERT_TRUE(seat);
  server.signal(SIGSTOP);
  EXPECT_EQ(take_remote_seat("hall", seat_named("2"), milliseconds(50)).error().code, ErrorCode::kTimeout);
  const auto begin = std::chrono::steady_clock::now();
  const Status stepped = seat->step(in(milliseconds(10)));
  ASSERT_FALSE(stepped);
  EXPECT_EQ(stepped.error().code, ErrorCode::kDisconnected);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kPatience);
}

}  // namespace
}  // namespace twocone::sim_povray

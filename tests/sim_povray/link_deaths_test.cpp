// SPDX-License-Identifier: Apache-2.0
// Programs are killed or stopped at one end of the link, and the other end must notice.
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
#include "tests/support/fails_with.h"

extern char** environ;

namespace twocone::sim_povray {
namespace {

using std::chrono::milliseconds;
using testing::Contains;
using testing_support::FailsWith;

/// A link_peer process, which is killed and reaped with this object.
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

TEST_F(LinkDeaths, AKilledClientDoesNotHoldUpOthers) {
  TestServer server("lab");
  auto survivor = join_world("1");
  open_views(*survivor);
  const auto files_before = open_files();
  std::mt19937_64 random(4711);
  constexpr int kTimes = 20;
  int attached = 0;
  for (int i = 0; i < kTimes; ++i) {
    PeerProcess client({"drive", "lab", "2"});
    // Half of the clients are killed at any time after their start, half of them certainly after they have joined.
    if (i % 2 == 0) {
      ASSERT_TRUE(eventually([&] { return server.host().sessions() == 2; }));
    }
    const auto life = in(milliseconds(random() % 40));
    while (std::chrono::steady_clock::now() < life) {
      const Status together = survivor->step(life);
      EXPECT_TRUE(together || together.error().code == ErrorCode::kTimeout) << together.error().message;
    }
    attached += server.host().sessions() == 2 ? 1 : 0;
    client.kill();
    const Status alone = survivor->step(in(kNoticed));
    EXPECT_TRUE(alone) << "after client " << i << ": " << alone.error().message;
    ASSERT_TRUE(eventually([&] { return server.host().sessions() == 1; }));
    expect_image(survivor->image(0), fake_image("1", 0, survivor->state().step, kSize));
  }
  EXPECT_GE(attached, kTimes / 2);
  EXPECT_TRUE(eventually([&] { return open_files() <= files_before; })) << open_files() << " of " << files_before;
  EXPECT_THAT(server.lines(), Contains("robot.2 left: the program ended"));
}

TEST_F(LinkDeaths, AClientThatDiesInALongStepIsRemovedAtOnce) {
  TestServer server("lab");
  auto other = join_world("1");  // never asks for a step, so that the step below cannot end
  {
    RawClient client;
    client.join("2");
    client.send(server::Step{std::chrono::minutes(1)});
    ASSERT_TRUE(eventually([&] { return server.host().robot("2").asks; }));
  }
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(eventually([&] { return server.host().sessions() == 1; }));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kNoticed);
  EXPECT_TRUE(other->step(in(kPatience)));
}

TEST_F(LinkDeaths, AKilledServerIsNoticedAndItsNameIsFree) {
  std::mt19937_64 random(4712);
  for (int i = 0; i < 5; ++i) {
    PeerProcess server({"serve", "lab"});
    auto one = join_world("1");
    auto two = join_world("2");
    open_views(*one);
    std::vector<std::shared_future<ImageResult>> images;
    SteadyTime killed;
    std::thread killer([&, life = in(milliseconds(random() % 60))] {
      std::this_thread::sleep_until(life);
      server.signal(SIGKILL);
      killed = std::chrono::steady_clock::now();
    });
    // The other robot never asks for a step, so that this one waits when the server is killed.
    EXPECT_EQ(one->step(in(kPatience)).error().code, ErrorCode::kDisconnected);
    const auto noticed = std::chrono::steady_clock::now();
    killer.join();
    EXPECT_LT(noticed - killed, kNoticed);
    for (int p = 0; p < 4; ++p) expect_disconnected(one->image(0));
    EXPECT_EQ(two->command({1, 1}).error().code, ErrorCode::kDisconnected);
    EXPECT_EQ(two->open_view({"lower", 1, {}}).error().code, ErrorCode::kDisconnected);
    EXPECT_TRUE(eventually([&] { return runtime_.files().empty(); })) << "something is left in the runtime folder";
  }
}

TEST_F(LinkDeaths, PendingImagesEndWithAKilledServer) {
  PeerProcess server({"serve", "lab"});
  auto session = join_world("1");
  open_views(*session);
  std::vector<std::shared_future<ImageResult>> images;
  for (int i = 0; i < 5; ++i) images.push_back(session->image(0));
  server.kill();
  for (const auto& image : images) {
    ASSERT_EQ(image.wait_for(kNoticed), std::future_status::ready);
    EXPECT_TRUE(image.get() || image.get().error().code == ErrorCode::kDisconnected);
  }
}

TEST_F(LinkDeaths, AStaleSocketIsTakenOver) {
  {
    PeerProcess server({"serve", "lab"});
    ASSERT_TRUE(eventually([&] { return runtime_.files().size() == 2; }));
  }
  EXPECT_EQ(runtime_.files().size(), 2u) << "this case requires files that kill -9 left and no client swept";
  TestServer next("lab");
  EXPECT_TRUE(join_world("1"));
}

TEST_F(LinkDeaths, ASuspendedServerIsGivenUp) {
  PeerProcess server({"serve", "lab"});
  auto session = join_world("1");
  server.signal(SIGSTOP);
  EXPECT_EQ(join_served_world("lab", session_named("2"), milliseconds(50)).error().code, ErrorCode::kTimeout);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT(session->step(in(milliseconds(10))), FailsWith(ErrorCode::kDisconnected));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kPatience);
}

}  // namespace
}  // namespace twocone::sim_povray

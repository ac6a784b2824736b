// SPDX-License-Identifier: Apache-2.0
// Clients and a server with a fake world: the traffic over the link, and clients that the server removes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <limits>

#include "tests/sim_povray/link_client.h"
#include "tests/sim_povray/link_messages.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::Contains;
using testing::HasSubstr;
using testing::MatchesRegex;
using testing_support::FailsWith;

TEST_F(Link, ARemoteSessionBehavesLikeALocalOne) {
  TestServer server("lab");
  auto remote = join_world("1");
  EXPECT_EQ(remote->state().pose, (Pose2{0, -1.5, 0.7}));
  CameraEffects effects{.distortion = {0.1, 0.2, 0.3, 0.4}, .distortion_focal_px = 300};
  ASSERT_TRUE(remote->open_view({"lower", 3, effects}));
  EXPECT_EQ(server.host().robot("1").views.at(0).effects, effects);
  EXPECT_EQ(server.host().robot("1").views.at(0).antialias, 3);
  EXPECT_EQ(server.host().robot("1").settings.body.radius_m, 0.2);
  ASSERT_TRUE(remote->configure_view(0, kSize));

  ASSERT_TRUE(remote->command({1.25, -0.5}));
  EXPECT_EQ(server.host().robot("1").speeds, (WheelSpeeds{1.25, -0.5}));
  ASSERT_TRUE(remote->halt());
  EXPECT_EQ(server.host().robot("1").speeds, WheelSpeeds{});

  ASSERT_TRUE(remote->step(in(kPatience)));
  EXPECT_EQ(remote->state().step, 1u);
  EXPECT_EQ(remote->state().contact, "landmark red");
  EXPECT_EQ(remote->state().now, std::chrono::nanoseconds(66'666'667));
  expect_image(remote->image(0), fake_image("1", 0, 1, kSize));

  EXPECT_THAT(remote->open_view({"sideways", 1, {}}).error().message, HasSubstr("sideways"));
  EXPECT_THAT(remote->configure_view(0, {64, 48, 30}), FailsWith(ErrorCode::kRefused));
  expect_image(remote->image(0), fake_image("1", 0, 1, kSize));
  remote->release_view(0);
  EXPECT_TRUE(remote->step(in(kPatience))) << "a request that the world refuses does not end the link";
}

TEST_F(Link, ImagesThatArriveOutOfOrderAreMatched) {
  TestServer server("lab");
  auto session = join_world("2");
  open_views(*session);
  for (int round = 0; round < 30; ++round) {
    std::vector<std::shared_future<ImageResult>> images;
    const std::uint64_t first = session->state().step;
    for (int i = 0; i < 3; ++i) {
      images.push_back(session->image(0));
      images.push_back(session->image(1));
      ASSERT_TRUE(session->step(in(kPatience)));
    }
    for (std::size_t i = 0; i < images.size(); ++i) {
      const auto view = std::uint32_t(i % 2);
      expect_image(images[i], fake_image("2", view, first + i / 2, kSize));
    }
  }
}

TEST_F(Link, ANewSizeAppliesToLaterImagesAndOldOnesStillArrive) {
  TestServer server("lab");
  auto session = join_world("1");
  ASSERT_TRUE(session->open_view({"lower", 1, {}}));
  ASSERT_TRUE(session->configure_view(0, kSize));
  const auto old = session->image(0);
  constexpr CameraSettings kLarger{123, 77, 15};
  ASSERT_TRUE(session->configure_view(0, kLarger));
  expect_image(session->image(0), fake_image("1", 0, 0, kLarger));
  expect_image(old, fake_image("1", 0, 0, kSize));
}

TEST_F(Link, TwoRobotsStepTogether) {
  TestServer server("lab");
  auto one = join_world("1");
  auto two = join_world("2");
  EXPECT_THAT(one->step(in(milliseconds(120))), FailsWith(ErrorCode::kTimeout)) << "a robot stepped without the other";
  constexpr int kSteps = 40;
  std::thread other([&two] {
    for (int i = 0; i < kSteps; ++i) {
      const Status stepped = two->step(in(kPatience));
      ASSERT_TRUE(stepped) << stepped.error().message;
    }
  });
  for (int i = 0; i < kSteps; ++i) {
    const Status stepped = one->step(in(kPatience));
    EXPECT_TRUE(stepped) << stepped.error().message;
  }
  other.join();
  EXPECT_EQ(one->state().step, std::uint64_t(kSteps));
  EXPECT_EQ(two->state().step, std::uint64_t(kSteps));
}

TEST_F(Link, AStepEndsAtItsDeadlineAndMayBeTriedAgain) {
  TestServer server("lab");
  auto one = join_world("1");
  auto two = join_world("2");
  for (const int wait_ms : {0, 1, 70, 130}) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(one->step(in(milliseconds(wait_ms))).error().code, ErrorCode::kTimeout);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, milliseconds(wait_ms) + seconds(2));
  }
  EXPECT_EQ(one->step(SteadyTime::min()).error().code, ErrorCode::kTimeout);
  two.reset();
  EXPECT_TRUE(one->step(SteadyTime::max())) << "the world still waits for the robot that left";
}

// Catches a world that waits forever for a program that is suspended (SIGSTOP) or hangs.
TEST_F(Link, ARobotThatAsksForNothingWhileOthersWaitIsRemoved) {
  constexpr milliseconds kShort{300};
  TestServer server("lab", kShort);
  auto one = join_world("1");
  auto two = join_world("2");
  std::this_thread::sleep_for(2 * kShort);
  const Status stepped = one->step(in(kPatience));
  ASSERT_TRUE(stepped) << "no robot waited for robot 2 until now, and robot 1 continues: " << stepped.error().message;
  const Status late = two->step(in(kPatience));
  ASSERT_FALSE(late);
  EXPECT_THAT(late.error().message, HasSubstr("others have waited for it for 0.3 s"));
  EXPECT_THAT(server.lines(), testing::Contains(HasSubstr("robot.2 left: others have waited for it")));
  EXPECT_TRUE(join_world("2")) << "its place is free again";
}

TEST_F(Link, ARobotThatWaitsForItsImagesIsNotRemoved) {
  constexpr milliseconds kShort{200};
  TestServer server("lab", kShort);
  auto one = join_world("1");
  auto two = join_world("2");
  open_views(*two);
  server.host().hold_images();
  const auto image = two->image(0);
  EXPECT_THAT(one->step(in(5 * kShort)), FailsWith(ErrorCode::kTimeout))
      << "robot 2 was removed although its image is being rendered";
  EXPECT_TRUE(two->command({1, 1}));
}

TEST_F(Link, TheNameOfALeavingRobotIsFreeAtOnce) {
  TestServer server("lab");
  for (int i = 0; i < 20; ++i) {
    auto session = join_world("1");
    ASSERT_TRUE(session->step(in(kPatience)));
    EXPECT_EQ(session->state().step, 1u) << "the world did not start again at time 0";
  }
  ASSERT_EQ(server.lines().size(), 41u);
  const auto lines = server.lines();
  EXPECT_THAT(lines[0], HasSubstr("serving 'lab' at "));
  for (std::size_t i = 1; i < lines.size(); i += 2) {
    EXPECT_THAT(lines[i], MatchesRegex("robot\\.1 attached \\(pid [0-9]+\\)"));
    EXPECT_EQ(lines[i + 1], "robot.1 left") << "the next robot was reported before";
  }
}

TEST_F(Link, ErrorsOfImagesAreTransmitted) {
  TestServer server("lab");
  auto session = join_world("1");
  EXPECT_EQ(session->image(0).get().error().code, ErrorCode::kInvalidState);
  open_views(*session);
  server.host().stretch_images();
  EXPECT_EQ(session->image(0).get().error().code, ErrorCode::kBadData);
  server.host().fail_images();
  EXPECT_THAT(session->image(1).get(), FailsWith(ErrorCode::kBadData, "FILE:3: POV-Ray: no such texture"));
  EXPECT_TRUE(session->step(in(kPatience)));
}

TEST_F(Link, SlotsCoverTheRunAheadAndAreReused) {
  TestServer server("lab");
  auto session = join_world("1");
  open_views(*session);
  const auto run_ahead = std::size_t(session_named("1").run_ahead_frames);
  for (int round = 0; round < 10; ++round) {
    std::vector<std::shared_future<ImageResult>> images;
    for (std::size_t i = 0; i < run_ahead + 2; ++i) images.push_back(session->image(0));
    for (const auto& image : images) expect_image(image, fake_image("1", 0, 0, kSize));
  }
}

TEST_F(Link, UnfinishedImagesEndWithTheirSession) {
  TestServer server("lab");
  auto session = join_world("1");
  open_views(*session);
  server.host().hold_images();
  const auto image = session->image(0);
  const auto begin = std::chrono::steady_clock::now();
  session.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kNoticed);
  expect_disconnected(image);
  EXPECT_EQ(server.host().sessions(), 0u);
}

TEST_F(Link, MissingMemoryIsReported) {
  TestServer server("lab");
  SessionSettings settings = session_named("1");
  settings.run_ahead_frames = 1000;  // 256 slots of 805 MB
  std::unique_ptr<RobotSession> first = join_world("2");
  auto session = value(join_served_world("lab", settings, kPatience));
  ASSERT_TRUE(session->open_view({"lower", 1, {}}));
  EXPECT_THAT(session->configure_view(0, {16384, 16384, 15}),
              FailsWith(ErrorCode::kUnavailable, HasSubstr("no shared memory for 256 images")));
  ASSERT_TRUE(session->configure_view(0, kSize)) << "the link must continue";
}

// ---- clients that are refused or removed

TEST_F(Link, AWorldThatNoProgramServesIsNotFound) {
  EXPECT_THAT(join_served_world("lab", session_named("1"), kPatience),
              FailsWith(ErrorCode::kNotFound, HasSubstr("lab")));
  EXPECT_EQ(join_served_world("../lab", session_named("1"), kPatience).error().code, ErrorCode::kRefused);
}

TEST_F(Link, TakenAndUnknownRobotsAreRefused) {
  TestServer server("lab");
  auto one = join_world("1");
  EXPECT_THAT(join_served_world("lab", session_named("1"), kPatience),
              FailsWith(ErrorCode::kRefused, HasSubstr("taken")));
  EXPECT_THAT(join_served_world("lab", session_named("9"), kPatience),
              FailsWith(ErrorCode::kRefused, HasSubstr("robot.9")));
  EXPECT_TRUE(one->step(in(kPatience)));
}

TEST_F(Link, WrongArgumentsThrowBeforeAnythingIsSent) {
  SessionSettings bad = session_named("1");
  bad.body.radius_m = -1;
  EXPECT_THROW(static_cast<void>(join_served_world("lab", bad, kPatience)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(join_served_world("lab", session_named(std::string(5000, 'x')), kPatience)),
               std::invalid_argument);
  TestServer server("lab");
  auto session = join_world("1");
  EXPECT_THROW(static_cast<void>(session->open_view({"lower", 0, {}})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(session->open_view({std::string(5000, 'x'), 1, {}})), std::invalid_argument);
  ASSERT_TRUE(session->open_view({"lower", 1, {}}));
  EXPECT_THROW(static_cast<void>(session->configure_view(0, {0, 48, 15})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(session->command({std::nan(""), 0})), std::invalid_argument);
  EXPECT_TRUE(session->step(in(kPatience)));
}

TEST_F(Link, AnotherVersionIsRefusedWithBothNamed) {
  TestServer server("lab");
  RawClient client;
  client.send(server::Hello{server::kMagic, server::kVersion + 6, "twocone 9.9"});
  const std::string why = client.refusal();
  EXPECT_THAT(why, HasSubstr("version " + std::to_string(server::kVersion) + " "));
  EXPECT_THAT(why, HasSubstr("version " + std::to_string(server::kVersion + 6) + " (twocone 9.9)"));
}

/// Listens like a server, and answers each message with the next of `answers`.
void pretend_to_serve(const std::vector<server::Message>& answers, const std::function<void()>& meanwhile) {
  const auto path = value(world_socket("fake"));
  const auto listening = value(server::listen_at(path));
  const std::jthread server([&] {
    base::UniqueFd socket;
    eventually([&] {
      socket = base::UniqueFd(::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      return socket.valid();
    });
    for (const auto& answer : answers) {
      static_cast<void>(server::receive_message(socket.get(), in(kPatience)).has_value());
      static_cast<void>(server::send_message(socket.get(), answer, in(kPatience)).has_value());
    }
    static_cast<void>(server::receive_message(socket.get(), in(kPatience)).has_value());
  });
  meanwhile();
}

TEST_F(Link, AServerOfAnotherVersionIsRefusedWithBothNamed) {
  pretend_to_serve({server::Hello{server::kMagic, server::kVersion + 1, "twocone 9.9"}}, [] {
    const auto session = join_served_world("fake", session_named("1"), kPatience);
    ASSERT_THAT(session,
                FailsWith(ErrorCode::kRefused, HasSubstr("version " + std::to_string(server::kVersion + 1) + " of")));
    EXPECT_THAT(session.error().message, HasSubstr("version " + std::to_string(server::kVersion) + " ("));
  });
}

TEST_F(Link, AServerThatSendsNonsenseIsDisconnected) {
  const SessionState state;
  SessionState nowhere;
  nowhere.pose.x_m = std::numeric_limits<double>::quiet_NaN();
  pretend_to_serve({server::Done{}}, [] {
    EXPECT_EQ(join_served_world("fake", session_named("1"), kPatience).error().code, ErrorCode::kBadData);
  });
  std::filesystem::remove(*world_socket("fake"));
  pretend_to_serve({server::Hello{}, server::Sessioned{nowhere}}, [] {
    EXPECT_EQ(join_served_world("fake", session_named("1"), kPatience).error().code, ErrorCode::kBadData);
  });
  for (const server::Message& nonsense : std::vector<server::Message>{
           server::Stepped{nowhere}, server::ViewOpened{1}, server::ImageDone{5, PixelFormat::kRgb8}, server::Hello{},
           server::ViewConfigured{8, 64 * 48 * 3}}) {
    std::filesystem::remove(*world_socket("fake"));
    pretend_to_serve({server::Hello{}, server::Sessioned{state}, nonsense}, [] {
      auto session = value(join_served_world("fake", session_named("1"), kPatience));
      EXPECT_EQ(session->step(in(milliseconds(10))).error().code, ErrorCode::kDisconnected);
      EXPECT_EQ(session->halt().error().code, ErrorCode::kDisconnected);
    });
  }
}

TEST_F(Link, MissingSharedMemoryIsAnError) {
  pretend_to_serve(
      {server::Hello{}, server::Sessioned{}, server::ViewOpened{0}, server::ViewConfigured{8, 64 * 48 * 3}}, [] {
        auto session = value(join_served_world("fake", session_named("1"), kPatience));
        ASSERT_TRUE(session->open_view({"lower", 1, {}}));
        EXPECT_EQ(session->configure_view(0, kSize).error().code, ErrorCode::kBadData);
      });
}

TEST_F(Link, AProgramThatBreaksTheProtocolIsRemovedAndOthersContinue) {
  TestServer server("lab");
  auto good = join_world("3");
  using namespace server;  // NOLINT(google-build-using-namespace): the protocol's own names
  const double nan = std::numeric_limits<double>::quiet_NaN();
  SessionSettings bad_session = session_named("1");
  bad_session.body.radius_m = nan;
  struct Case {
    std::string what;
    std::vector<Message> before;
    Message wrong;
    std::string answer;
  };
  const Message hello = Hello{};
  const Message take_1 = Take{session_named("1")};
  const Message view = OpenView{{"lower", 1, {}}};
  const Message size = ConfigureView{0, kSize};
  const std::vector<Case> cases = {
      {"no hello", {}, take_1, "does not know this link"},
      {"no twocone", {}, Hello{1, kVersion, "x"}, "does not know this link"},
      {"no take", {hello}, view, "session must be taken"},
      {"bad settings", {hello}, Take{bad_session}, "radius_m is nan m"},
      {"hello again", {hello, take_1}, hello, "a session does not accept this message"},
      {"take again", {hello, take_1}, take_1, "a session does not accept this message"},
      {"a server's message", {hello, take_1}, Stepped{}, "a session does not accept this message"},
      {"bad view", {hello, take_1}, OpenView{{"lower", 10, {}}}, "antialias"},
      {"no such view", {hello, take_1, view}, ConfigureView{1, kSize}, "view 1"},
      {"no such view to release", {hello, take_1, view}, ReleaseView{77}, "view 77"},
      {"no width", {hello, take_1, view}, ConfigureView{0, {0, 48, 15}}, "width_px"},
      {"no rate", {hello, take_1, view}, ConfigureView{0, {64, 48, nan}}, "rate_hz"},
      {"huge", {hello, take_1, view}, ConfigureView{0, {2147483647, 2147483647, 15}}, "2147483647"},
      {"image of no view", {hello, take_1, view, size}, ImageOrder{1, 1, 0}, "view 1"},
      {"image of no size", {hello, take_1, view}, ImageOrder{1, 0, 0}, "no size"},
      {"image in no slot", {hello, take_1, view, size}, ImageOrder{1, 0, 99}, "slot 99"},
      {"image of no number", {hello, take_1, view, size}, ImageOrder{0, 0, 0}, "numbers"},
      {"speeds", {hello, take_1}, Command{{nan, 1}}, "wheel speeds"},
      {"speeds", {hello, take_1}, Command{{1, -std::numeric_limits<double>::infinity()}}, "wheel speeds"},
      {"a step back", {hello, take_1}, Step{std::chrono::nanoseconds(-1)}, "time limit"},
      {"a step for ever", {hello, take_1}, Step{std::chrono::nanoseconds::max()}, "time limit"},
  };
  for (const Case& c : cases) {
    RawClient client;
    for (const Message& message : c.before) {
      client.send(message);
      ASSERT_TRUE(client.receive()) << c.what;
    }
    client.send(c.wrong);
    EXPECT_THAT(client.refusal(), HasSubstr(c.answer)) << c.what;
    ASSERT_TRUE(eventually([&] { return server.host().sessions() == 1; })) << c.what << ": its session is still open";
  }
  EXPECT_TRUE(good->step(in(kPatience)));
}

TEST_F(Link, BytesThatFormNoMessageAreRefused) {
  TestServer server("lab");
  for (const std::size_t size : {1u, 5u, 100u, unsigned(server::kMaxMessage), unsigned(server::kMaxMessage) + 1000u}) {
    RawClient before_the_hello;
    before_the_hello.send_bytes(std::vector<std::uint8_t>(size, 0xee));
    EXPECT_THAT(before_the_hello.refusal(), HasSubstr("no message"));
    RawClient joined;
    joined.join("1");
    joined.send_bytes(std::vector<std::uint8_t>(size, 0xee));
    EXPECT_THAT(joined.refusal(), HasSubstr("no message"));
    ASSERT_TRUE(eventually([&] { return server.host().sessions() == 0; }));
  }
}

TEST_F(Link, ASlotThatIsInUseIsRefused) {
  TestServer server("lab");
  server.host().hold_images();
  RawClient client;
  client.join_with_view("1");
  client.send(server::ImageOrder{1, 0, 3});
  client.send(server::ImageOrder{2, 0, 3});
  EXPECT_THAT(client.refusal(), HasSubstr("slot 3"));
}

TEST_F(Link, TheNumberOfViewsIsLimited) {
  TestServer server("lab");
  RawClient client;
  client.join("1");
  for (std::uint32_t i = 0; i < server::kMaxViews; ++i) {
    client.send(server::OpenView{{"lower", 1, {}}});
    ASSERT_TRUE(client.receive());
  }
  client.send(server::OpenView{{"lower", 1, {}}});
  EXPECT_THAT(client.refusal(), HasSubstr("64 views"));
}

TEST_F(Link, SilentClientsDoNotHoldUpOthers) {
  TestServer server("lab");
  std::vector<std::unique_ptr<RawClient>> silent;
  for (int i = 0; i < 20; ++i) silent.push_back(std::make_unique<RawClient>());
  const auto begin = std::chrono::steady_clock::now();
  auto session = join_world("1");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kNoticed);
  EXPECT_THAT(silent[0]->refusal(), HasSubstr("says nothing"));
  const auto waited = std::chrono::steady_clock::now() - begin;
  EXPECT_GT(waited, seconds(3));
  EXPECT_LT(waited, seconds(5) + kNoticed);
}

TEST_F(Link, TheSixtyFifthClientIsRefused) {
  TestServer server("lab");
  std::vector<std::unique_ptr<RawClient>> silent;
  for (int i = 0; i < 64; ++i) silent.push_back(std::make_unique<RawClient>());
  const auto session = join_served_world("lab", session_named("1"), kPatience);
  ASSERT_THAT(session, FailsWith(ErrorCode::kUnavailable)) << session.error().message;
  silent.clear();
  EXPECT_TRUE(eventually([] { return join_served_world("lab", session_named("1"), kPatience).has_value(); }));
}

// ---- start and end of a server

TEST_F(Link, TheSocketIsPrivateToTheUserAndRemovedWithTheServer) {
  {
    TestServer server("lab");
    ASSERT_TRUE(join_world("1"));
    struct stat status {};
    ASSERT_EQ(::stat(world_socket("lab")->c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
  }
  EXPECT_THAT(runtime_.files(), testing::IsEmpty());
}

TEST_F(Link, OneNameIsServedOnce) {
  TestServer first("lab");
  ASSERT_TRUE(join_world("1"));
  TestServer second("lab");
  const auto ended = eventually([&] { return second.ended(); });
  ASSERT_TRUE(ended);
  EXPECT_THAT(second.stop(), FailsWith(ErrorCode::kRefused));
  EXPECT_TRUE(join_world("1")) << "the first server must continue";
  TestServer other("lab-2");
  EXPECT_TRUE(join_world("1", "lab-2"));
}

TEST_F(Link, AStoppedServerReleasesItsClients) {
  TestServer server("lab");
  auto one = join_world("1");
  auto two = join_world("2");
  open_views(*one);
  server.host().hold_images();
  const auto image = one->image(0);
  std::thread stepper([&] {
    Status last;
    while (last) last = two->step(in(kPatience));  // it may take a step alone: the server ends sessions one by one
    EXPECT_EQ(last.error().code, ErrorCode::kDisconnected);
  });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(server.stop());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kNoticed);
  stepper.join();
  expect_disconnected(image);
  EXPECT_EQ(one->step(in(kPatience)).error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(one->command({1, 1}).error().code, ErrorCode::kDisconnected);
  EXPECT_THAT(server.lines(), Contains("robot.1 left: the server stops"));
  EXPECT_EQ(server.host().sessions(), 0u);
}

}  // namespace
}  // namespace twocone::sim_povray

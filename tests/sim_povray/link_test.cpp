// SPDX-License-Identifier: Apache-2.0
// Clients and a server with a fake world: what goes over the link, and who is sent away.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <limits>

#include "tests/sim_povray/link_client.h"
#include "tests/sim_povray/link_messages.h"

namespace twocone::sim_povray {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::Contains;
using testing::HasSubstr;
using testing::MatchesRegex;

TEST_F(Link, ASeatOfAnotherProgramIsLikeOneOfOnesOwn) {
  TestServer server("hall");
  auto remote = take("1");
  ASSERT_TRUE(remote);
  EXPECT_EQ(remote->state().pose, (Pose2{0, -1.5, 0.7}));
  CameraEffects effects;
  effects.distortion = {0.1, 0.2, 0.3, 0.4};
  effects.distortion_focal_px = 300;
  ASSERT_TRUE(remote->open_view({"lower", 3, effects}));
  EXPECT_EQ(server.hall().robot("1").views.at(0).effects, effects);
  EXPECT_EQ(server.hall().robot("1").views.at(0).antialias, 3);
  EXPECT_EQ(server.hall().robot("1").settings.body.radius_m, 0.2);
  ASSERT_TRUE(remote->configure_view(0, kSize));

  ASSERT_TRUE(remote->command({1.25, -0.5}));
  EXPECT_EQ(server.hall().robot("1").speeds, (WheelSpeeds{1.25, -0.5}));
  ASSERT_TRUE(remote->halt());
  EXPECT_EQ(server.hall().robot("1").speeds, WheelSpeeds{});

  ASSERT_TRUE(remote->step(in(kPatience)));
  EXPECT_EQ(remote->state().tick, 1u);
  EXPECT_EQ(remote->state().contact, "landmark red");
  EXPECT_EQ(remote->state().now, std::chrono::nanoseconds(66'666'667));
  expect_picture(remote->picture(0), fake_picture("1", 0, 1, kSize));

  EXPECT_THAT(remote->open_view({"sideways", 1, {}}).error().message, HasSubstr("sideways"));
  const auto refused = remote->configure_view(0, {64, 48, 30});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  expect_picture(remote->picture(0), fake_picture("1", 0, 1, kSize));
  remote->release_view(0);
  EXPECT_TRUE(remote->step(in(kPatience))) << "what the world refuses does not end the link";
}

TEST_F(Link, PicturesComeOutOfOrderAndEachFindsItsOwn) {
  TestServer server("hall");
  auto seat = take("2");
  ASSERT_TRUE(seat);
  open_views(*seat);
  for (int round = 0; round < 30; ++round) {
    std::vector<std::shared_future<ImageResult>> pictures;
    const std::uint64_t first = seat->state().tick;
    for (int i = 0; i < 3; ++i) {
      pictures.push_back(seat->picture(0));
      pictures.push_back(seat->picture(1));
      ASSERT_TRUE(seat->step(in(kPatience)));
    }
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      const auto view = std::uint32_t(i % 2);
      expect_picture(pictures[i], fake_picture("2", view, first + i / 2, kSize));
    }
  }
}

TEST_F(Link, ANewSizeHoldsForLaterPicturesAndOldOnesStillCome) {
  TestServer server("hall");
  auto seat = take("1");
  ASSERT_TRUE(seat);
  ASSERT_TRUE(seat->open_view({"lower", 1, {}}));
  ASSERT_TRUE(seat->configure_view(0, kSize));
  const auto old = seat->picture(0);
  constexpr CameraSettings kLarger{123, 77, 15};
  ASSERT_TRUE(seat->configure_view(0, kLarger));
  expect_picture(seat->picture(0), fake_picture("1", 0, 0, kLarger));
  expect_picture(old, fake_picture("1", 0, 0, kSize));
}

TEST_F(Link, TwoRobotsStepTogether) {
  TestServer server("hall");
  auto one = take("1");
  auto two = take("2");
  ASSERT_TRUE(one && two);
  const Status alone = one->step(in(milliseconds(120)));
  ASSERT_FALSE(alone) << "a robot stepped without the other";
  EXPECT_EQ(alone.error().code, ErrorCode::kTimeout);
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
  EXPECT_EQ(one->state().tick, std::uint64_t(kSteps));
  EXPECT_EQ(two->state().tick, std::uint64_t(kSteps));
}

TEST_F(Link, AStepEndsAtItsDeadlineAndMayBeTriedAgain) {
  TestServer server("hall");
  auto one = take("1");
  auto two = take("2");
  ASSERT_TRUE(one && two);
  for (const int wait_ms : {0, 1, 70, 130}) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(one->step(in(milliseconds(wait_ms))).error().code, ErrorCode::kTimeout);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, milliseconds(wait_ms) + seconds(2));
  }
  EXPECT_EQ(one->step(SteadyTime::min()).error().code, ErrorCode::kTimeout);
  two.reset();
  EXPECT_TRUE(one->step(SteadyTime::max())) << "the one that left is still waited for";
}

// Catches a world that waits for ever for a program that is stopped (SIGSTOP) or hangs.
TEST_F(Link, WhoAsksForNothingWhileOthersWaitIsSentAway) {
  constexpr milliseconds kShort{300};
  TestServer server("hall", kShort);
  auto one = take("1");
  auto two = take("2");
  ASSERT_TRUE(one && two);
  std::this_thread::sleep_for(2 * kShort);
  const Status stepped = one->step(in(kPatience));
  ASSERT_TRUE(stepped) << "nobody waited for robot 2 until now, and robot 1 goes on: " << stepped.error().message;
  const Status late = two->step(in(kPatience));
  ASSERT_FALSE(late);
  EXPECT_THAT(late.error().message, HasSubstr("others have waited for it for 0.3 s"));
  EXPECT_THAT(server.lines(), testing::Contains(HasSubstr("robot.2 left: others have waited for it")));
  EXPECT_TRUE(take("2")) << "its place is free again";
}

TEST_F(Link, WhoWaitsForItsPicturesIsNotSentAway) {
  constexpr milliseconds kShort{200};
  TestServer server("hall", kShort);
  auto one = take("1");
  auto two = take("2");
  ASSERT_TRUE(one && two);
  open_views(*two);
  server.hall().hold_pictures();
  const auto picture = two->picture(0);
  const Status alone = one->step(in(5 * kShort));
  ASSERT_FALSE(alone) << "robot 2 was sent away, though its picture is being rendered";
  EXPECT_EQ(alone.error().code, ErrorCode::kTimeout);
  EXPECT_TRUE(two->command({1, 1}));
}

TEST_F(Link, ALeavingRobotsSeatIsFreeAtOnce) {
  TestServer server("hall");
  for (int i = 0; i < 20; ++i) {
    auto seat = take("1");
    ASSERT_TRUE(seat);
    ASSERT_TRUE(seat->step(in(kPatience)));
    EXPECT_EQ(seat->state().tick, 1u) << "the world did not begin anew";
  }
  ASSERT_EQ(server.lines().size(), 41u);
  const auto lines = server.lines();
  EXPECT_THAT(lines[0], HasSubstr("serving 'hall' at "));
  for (std::size_t i = 1; i < lines.size(); i += 2) {
    EXPECT_THAT(lines[i], MatchesRegex("robot\\.1 attached \\(pid [0-9]+\\)"));
    EXPECT_EQ(lines[i + 1], "robot.1 left") << "the next one was told of before";
  }
}

TEST_F(Link, ErrorsOfPicturesComeThrough) {
  TestServer server("hall");
  auto seat = take("1");
  ASSERT_TRUE(seat);
  EXPECT_EQ(seat->picture(0).get().error().code, ErrorCode::kInvalidState);
  open_views(*seat);
  server.hall().stretch_pictures();
  EXPECT_EQ(seat->picture(0).get().error().code, ErrorCode::kBadData);
  server.hall().fail_pictures();
  const auto failed = seat->picture(1).get();
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().message, "FILE:3: POV-Ray: no such texture");
  EXPECT_TRUE(seat->step(in(kPatience)));
}

TEST_F(Link, SlotsCoverTheRunAheadAndAreUsedAgain) {
  TestServer server("hall");
  auto seat = take("1");
  ASSERT_TRUE(seat);
  open_views(*seat);
  const auto run_ahead = std::size_t(seat_named("1").run_ahead_frames);
  for (int round = 0; round < 10; ++round) {
    std::vector<std::shared_future<ImageResult>> pictures;
    for (std::size_t i = 0; i < run_ahead + 2; ++i) pictures.push_back(seat->picture(0));
    for (const auto& picture : pictures) expect_picture(picture, fake_picture("1", 0, 0, kSize));
  }
}

TEST_F(Link, PicturesThatNeverComeEndWithTheirSeat) {
  TestServer server("hall");
  auto seat = take("1");
  ASSERT_TRUE(seat);
  open_views(*seat);
  server.hall().hold_pictures();
  const auto picture = seat->picture(0);
  const auto begin = std::chrono::steady_clock::now();
  seat.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kNoticed);
  expect_disconnected(picture);
  EXPECT_EQ(server.hall().seats(), 0u);
}

TEST_F(Link, AFullMemoryIsAnAnswer) {
  TestServer server("hall");
  SeatSettings settings = seat_named("1");
  settings.run_ahead_frames = 1000;  // 256 slots of 805 MB
  std::unique_ptr<Seat> first = take("2");
  auto seat = take_remote_seat("hall", settings, kPatience);
  ASSERT_TRUE(seat) << seat.error().message;
  ASSERT_TRUE((*seat)->open_view({"lower", 1, {}}));
  const Status configured = (*seat)->configure_view(0, {16384, 16384, 15});
  ASSERT_FALSE(configured);
  EXPECT_EQ(configured.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(configured.error().message, HasSubstr("no shared memory for 256 pictures"));
  ASSERT_TRUE((*seat)->configure_view(0, kSize)) << "the link must go on";
}

// ---- who is sent away

TEST_F(Link, NobodyServes) {
  const auto nobody = take_remote_seat("hall", seat_named("1"), kPatience);
  ASSERT_FALSE(nobody);
  EXPECT_EQ(nobody.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(nobody.error().message, HasSubstr("hall"));
  EXPECT_EQ(take_remote_seat("../hall", seat_named("1"), kPatience).error().code, ErrorCode::kRefused);
}

TEST_F(Link, TakenAndUnknownRobotsAreRefused) {
  TestServer server("hall");
  auto one = take("1");
  ASSERT_TRUE(one);
  const auto again = take_remote_seat("hall", seat_named("1"), kPatience);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::kRefused);
  EXPECT_THAT(again.error().message, HasSubstr("taken"));
  const auto unknown = take_remote_seat("hall", seat_named("9"), kPatience);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("robot.9"));
  EXPECT_TRUE(one->step(in(kPatience)));
}

TEST_F(Link, WrongArgumentsAreThrownBeforeAnythingIsSent) {
  SeatSettings bad = seat_named("1");
  bad.body.radius_m = -1;
  EXPECT_THROW(static_cast<void>(take_remote_seat("hall", bad, kPatience)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(take_remote_seat("hall", seat_named(std::string(5000, 'x')), kPatience)),
               std::invalid_argument);
  TestServer server("hall");
  auto seat = take("1");
  ASSERT_TRUE(seat);
  EXPECT_THROW(static_cast<void>(seat->open_view({"lower", 0, {}})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(seat->open_view({std::string(5000, 'x'), 1, {}})), std::invalid_argument);
  ASSERT_TRUE(seat->open_view({"lower", 1, {}}));
  EXPECT_THROW(static_cast<void>(seat->configure_view(0, {0, 48, 15})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(seat->command({std::nan(""), 0})), std::invalid_argument);
  EXPECT_TRUE(seat->step(in(kPatience)));
}

TEST_F(Link, AnotherVersionIsRefusedWithBothNamed) {
  TestServer server("hall");
  RawClient client;
  client.say(link::Hello{link::kMagic, link::kVersion + 6, "twocone 9.9"});
  const std::string why = client.refusal();
  EXPECT_THAT(why, HasSubstr("version " + std::to_string(link::kVersion) + " "));
  EXPECT_THAT(why, HasSubstr("version " + std::to_string(link::kVersion + 6) + " (twocone 9.9)"));
}

/// Listens like a server, and says what it is told to.
void pretend_to_serve(const std::vector<link::Message>& lines, const std::function<void()>& meanwhile) {
  const auto path = world_socket("fake");
  ASSERT_TRUE(path);
  const auto listening = link::listen_at(*path);
  ASSERT_TRUE(listening) << listening.error().message;
  std::thread server([&] {
    UniqueFd socket;
    eventually([&] {
      socket = UniqueFd(::accept4(listening->get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      return socket.valid();
    });
    for (const auto& line : lines) {
      static_cast<void>(link::receive_message(socket.get(), in(kPatience)).has_value());
      static_cast<void>(link::send_message(socket.get(), line, in(kPatience)).has_value());
    }
    static_cast<void>(link::receive_message(socket.get(), in(kPatience)).has_value());
  });
  meanwhile();
  server.join();
}

TEST_F(Link, AServerOfAnotherVersionIsRefusedWithBothNamed) {
  pretend_to_serve({link::Hello{link::kMagic, link::kVersion + 1, "twocone 9.9"}}, [] {
    const auto seat = take_remote_seat("fake", seat_named("1"), kPatience);
    ASSERT_FALSE(seat);
    EXPECT_EQ(seat.error().code, ErrorCode::kRefused);
    EXPECT_THAT(seat.error().message, HasSubstr("version " + std::to_string(link::kVersion + 1) + " of"));
    EXPECT_THAT(seat.error().message, HasSubstr("version " + std::to_string(link::kVersion) + " ("));
  });
}

TEST_F(Link, AServerThatTalksNonsenseIsLeft) {
  const SeatState state;
  SeatState nowhere;
  nowhere.pose.x_m = std::numeric_limits<double>::quiet_NaN();
  pretend_to_serve({link::Done{}}, [] {
    EXPECT_EQ(take_remote_seat("fake", seat_named("1"), kPatience).error().code, ErrorCode::kBadData);
  });
  std::filesystem::remove(*world_socket("fake"));
  pretend_to_serve({link::Hello{}, link::Seated{nowhere}}, [] {
    EXPECT_EQ(take_remote_seat("fake", seat_named("1"), kPatience).error().code, ErrorCode::kBadData);
  });
  for (const link::Message& nonsense :
       std::vector<link::Message>{link::Stepped{nowhere}, link::ViewOpened{1}, link::PictureDone{5, PixelFormat::kRgb8},
                                  link::Hello{}, link::ViewConfigured{8, 64 * 48 * 3}}) {
    std::filesystem::remove(*world_socket("fake"));
    pretend_to_serve({link::Hello{}, link::Seated{state}, nonsense}, [] {
      auto seat = take_remote_seat("fake", seat_named("1"), kPatience);
      ASSERT_TRUE(seat) << seat.error().message;
      EXPECT_EQ((*seat)->step(in(milliseconds(10))).error().code, ErrorCode::kDisconnected);
      EXPECT_EQ((*seat)->halt().error().code, ErrorCode::kDisconnected);
    });
  }
}

TEST_F(Link, SharedMemoryThatDoesNotComeIsRefused) {
  pretend_to_serve({link::Hello{}, link::Seated{}, link::ViewOpened{0}, link::ViewConfigured{8, 64 * 48 * 3}}, [] {
    auto seat = take_remote_seat("fake", seat_named("1"), kPatience);
    ASSERT_TRUE(seat) << seat.error().message;
    ASSERT_TRUE((*seat)->open_view({"lower", 1, {}}));
    EXPECT_EQ((*seat)->configure_view(0, kSize).error().code, ErrorCode::kBadData);
  });
}

TEST_F(Link, AProgramThatDoesNotKeepToTheProtocolIsSentAwayAndOthersGoOn) {
  TestServer server("hall");
  auto good = take("3");
  ASSERT_TRUE(good);
  using namespace link;  // NOLINT(google-build-using-namespace): the protocol's own names
  const double nan = std::numeric_limits<double>::quiet_NaN();
  SeatSettings bad_seat = seat_named("1");
  bad_seat.body.radius_m = nan;
  struct Case {
    std::string what;
    std::vector<Message> before;
    Message wrong;
    std::string answer;
  };
  const Message hello = Hello{};
  const Message take_1 = Take{seat_named("1")};
  const Message view = OpenView{{"lower", 1, {}}};
  const Message size = ConfigureView{0, kSize};
  const std::vector<Case> cases = {
      {"no hello", {}, take_1, "no program that knows this link"},
      {"no twocone", {}, Hello{1, kVersion, "x"}, "no program that knows this link"},
      {"no take", {hello}, view, "seat must be taken"},
      {"bad settings", {hello}, Take{bad_seat}, "radius_m is nan m"},
      {"hello again", {hello, take_1}, hello, "nothing that a seat can be asked"},
      {"take again", {hello, take_1}, take_1, "nothing that a seat can be asked"},
      {"a server's word", {hello, take_1}, Stepped{}, "nothing that a seat can be asked"},
      {"bad view", {hello, take_1}, OpenView{{"lower", 10, {}}}, "antialias"},
      {"no such view", {hello, take_1, view}, ConfigureView{1, kSize}, "view 1"},
      {"no such view to release", {hello, take_1, view}, ReleaseView{77}, "view 77"},
      {"no width", {hello, take_1, view}, ConfigureView{0, {0, 48, 15}}, "width_px"},
      {"no rate", {hello, take_1, view}, ConfigureView{0, {64, 48, nan}}, "rate_hz"},
      {"huge", {hello, take_1, view}, ConfigureView{0, {2147483647, 2147483647, 15}}, "2147483647"},
      {"picture of no view", {hello, take_1, view, size}, PictureOrder{1, 1, 0}, "view 1"},
      {"picture of no size", {hello, take_1, view}, PictureOrder{1, 0, 0}, "no size"},
      {"picture in no slot", {hello, take_1, view, size}, PictureOrder{1, 0, 99}, "slot 99"},
      {"picture of no number", {hello, take_1, view, size}, PictureOrder{0, 0, 0}, "numbers"},
      {"speeds", {hello, take_1}, Command{{nan, 1}}, "wheel speeds"},
      {"speeds", {hello, take_1}, Command{{1, -std::numeric_limits<double>::infinity()}}, "wheel speeds"},
      {"a step back", {hello, take_1}, Step{std::chrono::nanoseconds(-1)}, "time limit"},
      {"a step for ever", {hello, take_1}, Step{std::chrono::nanoseconds::max()}, "time limit"},
  };
  for (const Case& c : cases) {
    RawClient client;
    for (const Message& message : c.before) {
      client.say(message);
      ASSERT_TRUE(client.hear()) << c.what;
    }
    client.say(c.wrong);
    EXPECT_THAT(client.refusal(), HasSubstr(c.answer)) << c.what;
    ASSERT_TRUE(eventually([&] { return server.hall().seats() == 1; })) << c.what << ": its seat is still taken";
  }
  EXPECT_TRUE(good->step(in(kPatience)));
}

TEST_F(Link, BytesThatAreNoMessageAreRefused) {
  TestServer server("hall");
  for (const std::size_t size : {1u, 5u, 100u, unsigned(link::kMaxMessage), unsigned(link::kMaxMessage) + 1000u}) {
    RawClient before_the_hello;
    before_the_hello.say_bytes(std::vector<std::uint8_t>(size, 0xee));
    EXPECT_THAT(before_the_hello.refusal(), HasSubstr("no message"));
    RawClient seated;
    seated.sit("1");
    seated.say_bytes(std::vector<std::uint8_t>(size, 0xee));
    EXPECT_THAT(seated.refusal(), HasSubstr("no message"));
    ASSERT_TRUE(eventually([&] { return server.hall().seats() == 0; }));
  }
}

TEST_F(Link, ASlotThatIsInUseIsRefused) {
  TestServer server("hall");
  server.hall().hold_pictures();
  RawClient client;
  client.sit_with_view("1");
  client.say(link::PictureOrder{1, 0, 3});
  client.say(link::PictureOrder{2, 0, 3});
  EXPECT_THAT(client.refusal(), HasSubstr("slot 3"));
}

TEST_F(Link, ViewsHaveAnEnd) {
  TestServer server("hall");
  RawClient client;
  client.sit("1");
  for (std::uint32_t i = 0; i < link::kMaxViews; ++i) {
    client.say(link::OpenView{{"lower", 1, {}}});
    ASSERT_TRUE(client.hear());
  }
  client.say(link::OpenView{{"lower", 1, {}}});
  EXPECT_THAT(client.refusal(), HasSubstr("64 views"));
}

TEST_F(Link, WhoCallsAndSaysNothingHoldsUpNobody) {
  TestServer server("hall");
  std::vector<std::unique_ptr<RawClient>> silent;
  for (int i = 0; i < 20; ++i) silent.push_back(std::make_unique<RawClient>());
  const auto begin = std::chrono::steady_clock::now();
  auto seat = take("1");
  ASSERT_TRUE(seat);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kNoticed);
  EXPECT_THAT(silent[0]->refusal(), HasSubstr("says nothing"));
  const auto waited = std::chrono::steady_clock::now() - begin;
  EXPECT_GT(waited, seconds(3));
  EXPECT_LT(waited, seconds(5) + kNoticed);
}

TEST_F(Link, TheSixtyFifthIsSentAway) {
  TestServer server("hall");
  std::vector<std::unique_ptr<RawClient>> silent;
  for (int i = 0; i < 64; ++i) silent.push_back(std::make_unique<RawClient>());
  const auto seat = take_remote_seat("hall", seat_named("1"), kPatience);
  ASSERT_FALSE(seat);
  EXPECT_EQ(seat.error().code, ErrorCode::kUnavailable) << seat.error().message;
  silent.clear();
  EXPECT_TRUE(eventually([] { return take_remote_seat("hall", seat_named("1"), kPatience).has_value(); }));
}

// ---- beginning and end of a server

TEST_F(Link, TheSocketIsTheUsersAloneAndGoesWithTheServer) {
  {
    TestServer server("hall");
    ASSERT_TRUE(take("1"));
    struct stat status {};
    ASSERT_EQ(::stat(world_socket("hall")->c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
  }
  EXPECT_THAT(runtime_.files(), testing::IsEmpty());
}

TEST_F(Link, OneNameIsServedOnce) {
  TestServer first("hall");
  ASSERT_TRUE(take("1"));
  TestServer second("hall");
  const auto ended = eventually([&] { return second.ended(); });
  ASSERT_TRUE(ended);
  const Status refused = second.stop();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_TRUE(take("1")) << "the first one must go on";
  TestServer other("hall-2");
  EXPECT_TRUE(take("1", "hall-2"));
}

TEST_F(Link, AStoppedServerLetsItsClientsGo) {
  TestServer server("hall");
  auto one = take("1");
  auto two = take("2");
  ASSERT_TRUE(one && two);
  open_views(*one);
  server.hall().hold_pictures();
  const auto picture = one->picture(0);
  std::thread stepper([&] {
    Status last;
    while (last) last = two->step(in(kPatience));  // alone it may go on for an instant: the server ends one by one
    EXPECT_EQ(last.error().code, ErrorCode::kDisconnected);
  });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(server.stop());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kNoticed);
  stepper.join();
  expect_disconnected(picture);
  EXPECT_EQ(one->step(in(kPatience)).error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(one->command({1, 1}).error().code, ErrorCode::kDisconnected);
  EXPECT_THAT(server.lines(), Contains("robot.1 left: the server stops"));
  EXPECT_EQ(server.hall().seats(), 0u);
}

}  // namespace
}  // namespace twocone::sim_povray

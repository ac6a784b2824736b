// SPDX-License-Identifier: Apache-2.0
#include "apps/viewer/live_run.h"

#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/recording/foxglove.pb.h"
#include "tests/report/synthetic_run.h"
#include "tests/viewer/browser.h"

namespace twocone::viewer {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

/// A run whose frames the test makes.
class LiveRunTest : public testing::Test {
 protected:
  void open(bool manual) {
    live_.emplace(run_.robot, run_.map, false, manual);
    auto address = live_->open({});
    ASSERT_TRUE(address) << address.error().message;
    address_ = *address;
    options_.out = "runs/a";
    live_->watch(options_);
  }
  void finish_frame(std::uint64_t number) {
    runs::FinishedFrame frame;
    frame.record.frame.frame = number;
    frame.lower = frame.upper =
        std::make_shared<const Image>(Image{8, 6, PixelFormat::kGrey8, Bytes(std::vector<std::uint8_t>(48, 99))});
    options_.finished(frame, {.age_s = 0.25, .late_frames = 3});
  }
  [[nodiscard]] const runs::RemoteControl& remote() const { return *options_.remote; }
  /// Waits until the requested speed is `speed`; false: it did not become so.
  [[nodiscard]] bool becomes(double speed) const {
    for (int i = 0; i < 500; ++i, std::this_thread::sleep_for(1ms)) {
      if (remote().requested().speed == speed) return true;
    }
    return false;
  }

  const report::ScratchFolder folder_;
  runlog::RunData run_ = report::synthetic_run(folder_.path(), 2);
  std::optional<LiveRun> live_;
  std::string address_;
  runs::RunOptions options_;
};

TEST_F(LiveRunTest, ABrowserGetsTheRunAndItsFramesWithTheirImages) {
  open(false);
  Browser early(address_);
  ASSERT_TRUE(early.is_open());
  options_.opened(run_.info);
  Browser late(address_);
  for (Browser* const browser : {&early, &late}) {
    const auto first = browser->next("run");
    ASSERT_TRUE(first);
    EXPECT_EQ((*first)["name"], "a");
    EXPECT_TRUE((*first)["live"]);
  }
  finish_frame(7);
  for (Browser* const browser : {&early, &late}) {
    const auto frame = browser->next("frame");
    ASSERT_TRUE(frame);
    EXPECT_EQ((*frame)["frame"], 7);
    EXPECT_EQ((*frame)["age_s"], 0.25);
    EXPECT_EQ((*frame)["late_frames"], 3);
    EXPECT_EQ(browser->last_image().substr(0, 12), std::string("\x07\0\0\0\0\0\0\0\x01\0\xff\xd8", 12))
        << "an upper JPEG";
  }
  live_->event("something happened");
  EXPECT_EQ((*early.next("event"))["text"], "something happened");
  live_->end("a cable came off");
  const auto end = early.next("end");
  ASSERT_TRUE(end);
  EXPECT_FALSE((*end)["finished"]);
}

TEST_F(LiveRunTest, OneBrowserDrivesUntilItReleases) {
  open(true);
  Browser first(address_), second(address_);
  first.send({{"type", "drive"}, {"speed", 0.5}, {"turn", 0}});
  EXPECT_TRUE(becomes(0.5));
  second.send({{"type", "drive"}, {"speed", -1}, {"turn", 0}});
  EXPECT_EQ((*second.next("refused"))["text"], "another browser drives");
  EXPECT_EQ(remote().requested().speed, 0.5);
  second.send({{"type", "release"}});  // not its own
  first.send({{"type", "release"}});
  EXPECT_TRUE(becomes(0));
  second.send({{"type", "drive"}, {"speed", -1}, {"turn", 0}});
  EXPECT_TRUE(becomes(-1));
}

TEST_F(LiveRunTest, TheWheelsAreReleasedWhenTheDriverIsKilled) {
  open(true);
  Browser driver(address_);
  driver.send({{"type", "drive"}, {"speed", 1}, {"turn", 0}});
  ASSERT_TRUE(becomes(1));
  driver.kill();
  EXPECT_TRUE(becomes(0));
}

TEST_F(LiveRunTest, ASilentDriverLosesTheWheels) {
  open(true);
  Browser silent(address_), other(address_);
  silent.send({{"type", "drive"}, {"speed", 1}, {"turn", 0}});
  ASSERT_TRUE(becomes(1));
  std::this_thread::sleep_for(runs::RemoteControl::kValid + 50ms);
  EXPECT_EQ(remote().requested().speed, 0);
  other.send({{"type", "drive"}, {"speed", 0.25}, {"turn", 0}});
  EXPECT_TRUE(becomes(0.25));
}

TEST_F(LiveRunTest, EveryBrowserStopsTheWheelsOfAnyBehaviour) {
  open(false);
  Browser watcher(address_);
  const auto you = watcher.next("status");
  ASSERT_TRUE(you);
  EXPECT_FALSE((*you)["manual"]);
  watcher.send({{"type", "drive"}, {"speed", 1}, {"turn", 0}});
  EXPECT_THAT((*watcher.next("refused"))["text"].get<std::string>(), testing::HasSubstr("behaviour manual"));
  watcher.send({{"type", "stop"}});
  EXPECT_TRUE((*watcher.next("status"))["stopped"]);
  EXPECT_TRUE(remote().is_held());
  watcher.send({{"type", "go"}});
  EXPECT_FALSE((*watcher.next("status"))["stopped"]);
  EXPECT_FALSE(remote().is_held());
}

TEST_F(LiveRunTest, AnyOtherRequestIsRefused) {
  open(true);
  Browser browser(address_);
  for (const char* const text :
       {"", "{", "[]", "7", "null", R"({"type":"fly"})", R"({"type":"drive"})", R"({"type":["drive"]})",
        R"({"type":"drive","speed":2,"turn":0})", R"({"type":"drive","speed":1e999,"turn":0})",
        R"({"type":"drive","speed":"1","turn":0})", "[[[[[[[[[[[[[[[[[[[["}) {
    browser.send_text(text);
    EXPECT_TRUE(browser.next("refused")) << text;
  }
  EXPECT_EQ(remote().requested(), behaviours::Shares{});
  EXPECT_FALSE(remote().is_held());
}

// ---- programs that speak the Foxglove WebSocket protocol

class FoxgloveTest : public LiveRunTest {
 protected:
  FoxgloveTest() {
    open(false);
    const web::Address address = web::parse_served(address_);
    client_.emplace(address);
    client_->send(web::request(address, "/foxglove?token=" + address.token,
                               web::upgrade_headers() + "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n"));
    EXPECT_EQ(client_->reply().value_or(web::Reply{}).status, 101);
    EXPECT_EQ(text()["op"], "serverInfo");
    const json advertised = text();
    for (const json& channel : advertised["channels"]) channels_[channel["topic"]] = channel;
    options_.opened(run_.info);
  }
  json text() {
    const auto frame = client_->frame();
    return frame && frame->opcode == web::kText ? json::parse(frame->payload, nullptr, false) : json();
  }
  void send(const json& request) { client_->send(web::browser_text(request.dump())); }
  void subscribe(std::uint32_t id, const std::string& topic) {
    send({{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channels_.at(topic)["id"]}}}}});
  }
  /// Makes frames until data have come; returns the subscription and the content.
  std::pair<std::uint32_t, std::string> data() {
    for (int i = 0; i < 100; ++i) {
      finish_frame(++made_);  // the request for it may still be on its way
      const auto frame = client_->frame(50ms);
      if (!frame || frame->opcode != web::kBinary || frame->payload.size() < 13) continue;
      EXPECT_EQ(frame->payload[0], 1);
      std::uint32_t id = 0;
      std::memcpy(&id, frame->payload.data() + 1, sizeof id);
      return {id, frame->payload.substr(13)};
    }
    return {};
  }

  std::optional<web::RawClient> client_;
  std::map<std::string, json> channels_;
  std::uint64_t made_ = 0;
};

TEST_F(FoxgloveTest, AProgramGetsTheTopicsThatItSubscribesTo) {
  EXPECT_EQ(channels_.at("/track")["schemaName"], "foxglove.PoseInFrame");
  EXPECT_EQ(channels_.at("/track")["schemaEncoding"], "protobuf");
  EXPECT_EQ(channels_.at("/telemetry")["encoding"], "json");
  subscribe(7, "/lower/image");
  const auto [id, bytes] = data();
  EXPECT_EQ(id, 7U);
  foxglove::CompressedImage image;
  ASSERT_TRUE(image.ParseFromString(bytes));
  EXPECT_EQ(image.format(), "jpeg");
  EXPECT_EQ(image.frame_id(), "lower");
  EXPECT_FALSE(image.data().empty());
}

TEST_F(FoxgloveTest, WhatTheWholeRunHasComesFirst) {
  subscribe(4'000'000'000, "/landmarks");
  const auto [id, bytes] = data();
  EXPECT_EQ(id, 4'000'000'000);
  foxglove::SceneUpdate landmarks;
  ASSERT_TRUE(landmarks.ParseFromString(bytes));
  EXPECT_EQ(landmarks.entities_size(), int(run_.map.landmarks.size()));
}

TEST_F(FoxgloveTest, WrongRequestsAreAnsweredAndUnsubscribedTopicsEnd) {
  for (const json& wrong :
       {json{{"op", "fly"}}, json{1, 2}, json{{"op", "subscribe"}, {"subscriptions", {{{"id", 1}}}}},
        json{{"op", "subscribe"}, {"subscriptions", {{{"id", -1}, {"channelId", 0}}}}},
        json{{"op", "subscribe"}, {"subscriptions", {{{"id", 1}, {"channelId", 99}}}}}}) {
    send(wrong);
    const json answer = text();
    EXPECT_EQ(answer["op"], "status") << wrong;
    EXPECT_EQ(answer["level"], 2);
  }
  subscribe(1, "/telemetry");
  EXPECT_EQ(data().first, 1U);
  send({{"op", "unsubscribe"}, {"subscriptionIds", {1}}});
  subscribe(2, "/lower/image");
  std::uint32_t id = 1;
  for (int i = 0; i < 100 && id == 1; ++i) id = data().first;
  EXPECT_EQ(id, 2U) << "the first that still comes may have been on its way";
}

}  // namespace
}  // namespace twocone::viewer

// SPDX-License-Identifier: Apache-2.0
#include "apps/viewer/live_run.h"

#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace twocone::viewer

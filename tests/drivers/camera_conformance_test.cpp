// SPDX-License-Identifier: Apache-2.0
#include "tests/drivers/camera_conformance.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "tests/support/fails_with.h"

namespace twocone::test {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using std::chrono::steady_clock;
using testing_support::FailsWith;

// The limit for a frame or image that will come: a simulated one must be rendered, on a machine that may be busy. Only
// a test that fails waits this long.
constexpr auto kLong = 30s;

// The limit for "at once" on a machine with other load. A grab that waited for the next frame at kSlow_hz would take
// twice as long.
constexpr auto kPrompt = 1s;
constexpr double kSlow_hz = 0.5;

// Two capture times are each rounded to a nanosecond.
constexpr auto kRounding = 1ns;

nanoseconds periods(double count, double rate_hz) { return nanoseconds(std::llround(count * 1e9 / rate_hz)); }

}  // namespace

void CameraConformance::start(const CameraSettings& settings) {
  const auto applied = camera().configure(settings);
  ASSERT_TRUE(applied) << applied.error().message;
  applied_ = *applied;
  const auto started = camera().start();
  ASSERT_TRUE(started) << started.error().message;
}

Result<Frame> CameraConformance::next() { return camera().grab(kLong); }

// Catches a backend that bypasses the state machine of Camera, or one that cannot continue after stop().
TEST_P(CameraConformance, AnswersEveryCallInEveryState) {
  using State = Camera::State;
  struct Setup {
    const char* name;
    State state;
    bool streamed_before;
  };
  constexpr Setup kSetups[] = {{"closed", State::kClosed, false},
                               {"configured", State::kConfigured, false},
                               {"streaming", State::kStreaming, false},
                               {"stopped", State::kConfigured, true},
                               {"streaming again", State::kStreaming, true}};
  struct Call {
    const char* name;
    std::function<Status()> call;
    std::function<bool(State)> allowed;
    std::function<State(State)> after;  ///< if allowed
  };
  const auto status = [](const auto& result) { return result ? Status() : Status(result.error()); };
  const Call calls[] = {{"configure", [&] { return status(camera().configure(GetParam().settings)); },
                         [](State s) { return s != State::kStreaming; }, [](State) { return State::kConfigured; }},
                        {"start", [&] { return camera().start(); }, [](State s) { return s == State::kConfigured; },
                         [](State) { return State::kStreaming; }},
                        {"grab", [&] { return status(next()); }, [](State s) { return s == State::kStreaming; },
                         [](State s) { return s; }},
                        {"stop", [&] { return camera().stop(), Status(); }, [](State) { return true; },
                         [](State s) { return s == State::kStreaming ? State::kConfigured : s; }}};

  for (const Setup& setup : kSetups) {
    for (const Call& call : calls) {
      SCOPED_TRACE(std::string(call.name) + " when " + setup.name);
      reopen();
      if (setup.state != State::kClosed) {
        const auto applied = camera().configure(GetParam().settings);
        ASSERT_TRUE(applied) << applied.error().message;
        applied_ = *applied;
      }
      if (setup.streamed_before) {
        ASSERT_TRUE(camera().start());
        camera().stop();
      }
      if (setup.state == State::kStreaming) {
        ASSERT_TRUE(camera().start());
      }
      ASSERT_EQ(camera().state(), setup.state);

      const Status answer = call.call();
      if (call.allowed(setup.state)) {
        EXPECT_TRUE(answer) << answer.error().message;
        EXPECT_EQ(camera().state(), call.after(setup.state));
      } else {
        EXPECT_THAT(answer, FailsWith(ErrorCode::kInvalidState));
        EXPECT_EQ(camera().state(), setup.state);
      }
    }
  }
}

// Catches a backend whose frames differ from the settings that it reports.
TEST_P(CameraConformance, ReportsTheSettingsThatItApplies) {
  constexpr int kFrames = 4;
  for (const CameraSettings& wanted : {CameraSettings{61, 47, 7.3}, CameraSettings{100, 30, 31.7}}) {
    SCOPED_TRACE(testing::Message() << wanted.width_px << " x " << wanted.height_px << " at " << wanted.rate_hz);
    start(wanted);
    EXPECT_NO_THROW(check(applied_));
    const auto first = next();
    ASSERT_TRUE(first) << first.error().message;
    auto last = first;
    for (int i = 1; i < kFrames; ++i) {
      last = next();
      ASSERT_TRUE(last) << last.error().message;
    }
    const auto image = last->image(kLong);
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ((*image)->width_px, applied_.width_px);
    EXPECT_EQ((*image)->height_px, applied_.height_px);
    const auto span = last->header().captured - first->header().captured;
    const auto exposures = static_cast<double>(last->header().sequence - first->header().sequence);
    EXPECT_LE(std::chrono::abs(span - periods(exposures, applied_.rate_hz)), 2 * kRounding + GetParam().jitter);
    camera().stop();
  }
}

// Catches a backend that passes impossible numbers to a device, and one that is left half configured by them.
TEST_P(CameraConformance, RefusesImpossibleSettings) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const CameraSettings& bad : {CameraSettings{0, 48, 20}, CameraSettings{64, -1, 20}, CameraSettings{64, 48, 0},
                                    CameraSettings{64, 48, -5}, CameraSettings{64, 48, kNaN}}) {
    EXPECT_THROW((void)camera().configure(bad), std::invalid_argument)
        << bad.width_px << " x " << bad.height_px << " at " << bad.rate_hz;
    EXPECT_EQ(camera().state(), Camera::State::kClosed);
  }
  start();
  EXPECT_TRUE(next());
}

TEST_P(CameraConformance, RefusesANegativeTimeout) {
  start();
  EXPECT_THROW((void)camera().grab(-1ms), std::invalid_argument);
  EXPECT_EQ(camera().state(), Camera::State::kStreaming);
}

// Catches a backend that leaks its buffers, its thread or its place in the world on stop.
TEST_P(CameraConformance, StartsAgainAfterStop) {
  start();
  for (int round = 0; round < 3; ++round) {
    const auto frame = next();
    ASSERT_TRUE(frame) << "round " << round << ": " << frame.error().message;
    const auto image = frame->image(kLong);
    EXPECT_TRUE(image) << "round " << round << ": " << image.error().message;
    camera().stop();
    const auto started = camera().start();
    ASSERT_TRUE(started) << "round " << round << ": " << started.error().message;
  }
}

// Catches a backend that returns a buffer twice, numbers frames by grabs instead of exposures, stamps a frame when it
// is grabbed instead of when it was taken, or adds up rounded periods.
TEST_P(CameraConformance, CountsAndTimesItsExposures) {
  constexpr int kFrames = 7;
  start();
  auto before = next();
  ASSERT_TRUE(before) << before.error().message;
  const Frame::Header first = before->header();
  for (int i = 1; i < kFrames; ++i) {
    const auto frame = next();
    ASSERT_TRUE(frame) << frame.error().message;
    const Frame::Header& now = frame->header();
    const Frame::Header& last = before->header();
    ASSERT_GT(now.sequence, last.sequence);
    EXPECT_EQ(now.lost_before, now.sequence - last.sequence - 1) << "frame " << now.sequence;
    EXPECT_EQ(now.captured.clock, first.captured.clock);
    // The reference is the first frame, not the last one, so that a drift is not hidden by the rounding.
    const auto expected = periods(static_cast<double>(now.sequence - first.sequence), applied_.rate_hz);
    EXPECT_LE(std::chrono::abs((now.captured - first.captured) - expected), 2 * kRounding + GetParam().jitter)
        << "frame " << now.sequence << " taken " << (now.captured - first.captured).count() << " ns after the first";
    before = frame;
  }
}

// Catches a grab that waits for a frame although its timeout is 0.
TEST_P(CameraConformance, AGrabWithoutTimeoutReturnsAtOnce) {
  auto slow = GetParam().settings;
  slow.rate_hz = kSlow_hz;
  start(slow);
  ASSERT_TRUE(next());
  const auto asked = steady_clock::now();
  const auto frame = camera().grab(0ms);
  EXPECT_LT(steady_clock::now() - asked, kPrompt);
  if (!frame) {
    EXPECT_EQ(frame.error().code, ErrorCode::kTimeout) << frame.error().message;
  }
}

// Catches a grab that ignores its timeout, and one that cannot be tried again.
TEST_P(CameraConformance, AGrabKeepsItsTimeout) {
  auto slow = GetParam().settings;
  slow.rate_hz = kSlow_hz;
  start(slow);
  ASSERT_TRUE(next());
  const auto asked = steady_clock::now();
  const auto frame = camera().grab(30ms);
  EXPECT_LT(steady_clock::now() - asked, 30ms + kPrompt);
  if (!frame) {
    EXPECT_EQ(frame.error().code, ErrorCode::kTimeout) << frame.error().message;
  }
  EXPECT_TRUE(next());
}

// Catches a deadline that overflows: the largest timeout does not fit into nanoseconds and could become negative.
TEST_P(CameraConformance, AGrabMayHaveAnyTimeout) {
  start();
  ASSERT_TRUE(next());
  const auto frame = camera().grab(std::chrono::milliseconds::max());
  EXPECT_TRUE(frame) << frame.error().message;
}

// Catches padding between rows, a wrong pixel format, a half-filled buffer.
TEST_P(CameraConformance, ImagesMatchTheirHeader) {
  start();
  const auto frame = next();
  ASSERT_TRUE(frame) << frame.error().message;
  const auto image = frame->image(kLong);
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ((*image)->width_px, applied_.width_px);
  EXPECT_EQ((*image)->height_px, applied_.height_px);
  const auto promised = image_bytes((*image)->format, applied_.width_px, applied_.height_px);
  EXPECT_EQ((*image)->bytes.size(), promised.value_or((*image)->bytes.size()));
  EXPECT_TRUE(to_rgb8(**image));
}

// Catches a backend that reuses the buffer of a frame that is still held.
TEST_P(CameraConformance, AFrameKeepsItsPixels) {
  start();
  const auto frame = next();
  ASSERT_TRUE(frame) << frame.error().message;
  const auto image = frame->image(kLong);
  ASSERT_TRUE(image) << image.error().message;
  const Image then = **image;
  for (int i = 0; i < 3; ++i) {
    const auto later = next();
    ASSERT_TRUE(later) << later.error().message;
    ASSERT_TRUE(later->image(kLong));
  }
  const auto again = frame->image(0ms);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->get(), image->get()) << "two calls must return the same image";
  EXPECT_EQ(**again, then);
}

// Catches pixels that are owned by the camera: a recorder still writes them after the robot is destroyed.
TEST_P(CameraConformance, AFrameOutlivesItsCamera) {
  start();
  std::vector<Frame> frames;
  {
    auto frame = next();
    ASSERT_TRUE(frame) << frame.error().message;
    frames.push_back(*frame);
  }
  const auto before = frames[0].image(kLong);
  ASSERT_TRUE(before) << before.error().message;
  opened_ = {};
  const auto after = frames[0].image(0ms);
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_EQ(**after, **before);
}

// Catches a promise that is dropped when the camera is destroyed: image() would throw, or wait for ever.
TEST_P(CameraConformance, APendingFrameAnswersAfterItsCameraIsGone) {
  start();
  auto frame = next();
  ASSERT_TRUE(frame) << frame.error().message;
  opened_ = {};
  ASSERT_NO_THROW({
    const auto image = frame->image(kLong);
    if (!image) {
      EXPECT_NE(image.error().code, ErrorCode::kTimeout) << "the image cannot arrive any more";
    }
  });
}

// Catches a destructor that leaves the stream to the base class, which can no longer end it.
TEST_P(CameraConformance, IsDestroyedWhileStreamingAndOpensAgain) {
  for (int round = 0; round < 2; ++round) {
    start();
    const auto frame = next();
    ASSERT_TRUE(frame) << "round " << round << ": " << frame.error().message;
    opened_ = {};
    reopen();
  }
}

// Catches a queue of stale frames: a robot whose program was delayed must not then drive by an old image.
TEST_P(CameraThatDoesNotWait, ALateReaderGetsTheNewestFrameAndTheNumberOfLostOnes) {
  start();
  const auto first = next();
  ASSERT_TRUE(first) << first.error().message;
  constexpr int kMissed = 3;
  opened_.pass(periods(kMissed + 1.5, applied_.rate_hz));
  const auto frame = camera().grab(kLong);
  ASSERT_TRUE(frame) << frame.error().message;
  const auto ahead = frame->header().sequence - first->header().sequence;
  EXPECT_GE(ahead, std::uint64_t(kMissed) + 1);
  EXPECT_EQ(frame->header().lost_before, ahead - 1);
  EXPECT_LE(std::chrono::abs((frame->header().captured - first->header().captured) -
                             periods(static_cast<double>(ahead), applied_.rate_hz)),
            2 * kRounding + GetParam().jitter);
}

// Catches a grab that returns at its deadline before it looks: a program that polls would never get an image.
TEST_P(CameraThatDoesNotWait, AnAvailableFrameIsReturnedWithATimeoutOfZero) {
  start();
  ASSERT_TRUE(next());
  for (int i = 0; i < 3; ++i) {
    opened_.pass(periods(1.5, applied_.rate_hz));
    const auto frame = camera().grab(0ms);
    ASSERT_TRUE(frame) << frame.error().message;
  }
}

// Catches a simulation that advances by itself: the frames of a slow program would depend on the machine.
TEST_P(CameraInLockStep, EveryGrabIsExactlyOneFrame) {
  start();
  for (std::uint64_t i = 0; i < 5; ++i) {
    const auto frame = next();
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->header().sequence, i);
    EXPECT_EQ(frame->header().lost_before, 0U);
    EXPECT_EQ(frame->header().captured.clock, ClockKind::kSimulated);
  }
}

}  // namespace twocone::test

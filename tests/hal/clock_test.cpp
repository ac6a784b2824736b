// SPDX-License-Identifier: Apache-2.0
#include "hal/clock.h"

#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

namespace twocone {
namespace {

using namespace std::chrono_literals;

TEST(Timestamp, DifferenceIsSignedAndExact) {
  const Timestamp early{ClockKind::kSimulated, 1'000'000'001ns};
  const Timestamp late{ClockKind::kSimulated, 1'000'000'008ns};
  EXPECT_EQ(late - early, 7ns);
  EXPECT_EQ(early - late, -7ns);
  EXPECT_DOUBLE_EQ(late.seconds(), 1.000000008);
}

// Catches a log that mixes simulated and real time: the difference would have no meaning.
TEST(Timestamp, OfTwoClocksCannotBeCompared) {
  const Timestamp simulated{ClockKind::kSimulated, 5ns};
  const Timestamp steady{ClockKind::kSteady, 5ns};
  EXPECT_THROW((void)(simulated - steady), std::invalid_argument);
  EXPECT_NE(simulated, steady);
}

TEST(ManualClock, ChangesOnlyByAdvance) {
  ManualClock clock;
  EXPECT_EQ(clock.now(), (Timestamp{ClockKind::kSimulated, 0ns}));
  clock.advance(66'666'667ns);
  clock.advance(0ns);
  clock.advance(3ns);
  EXPECT_EQ(clock.now(), (Timestamp{ClockKind::kSimulated, 66'666'670ns}));
}

TEST(ManualClock, NeverRunsBackwards) {
  ManualClock clock;
  clock.advance(5ns);
  EXPECT_THROW(clock.advance(-1ns), std::invalid_argument);
  EXPECT_EQ(clock.now().since_zero, 5ns);
}

TEST(ManualClock, ReportsItsClockKind) { EXPECT_EQ(ManualClock(ClockKind::kSteady).now().clock, ClockKind::kSteady); }

// Under ThreadSanitizer, this test catches a clock that is not safe to read while it is advanced.
TEST(ManualClock, IsReadWhileItAdvances) {
  constexpr int kSteps = 1000;
  ManualClock clock;
  std::jthread writer([&clock] {
    for (int i = 0; i < kSteps; ++i) clock.advance(1ns);
  });
  for (Timestamp last = clock.now(); last.since_zero.count() < kSteps;) {
    const Timestamp now = clock.now();
    ASSERT_GE(now - last, 0ns);
    last = now;
  }
}

TEST(SteadyClock, IsStdSteadyClock) {
  const SteadyClock clock;
  const auto before = std::chrono::steady_clock::now().time_since_epoch();
  const Timestamp now = clock.now();
  const auto after = std::chrono::steady_clock::now().time_since_epoch();
  EXPECT_EQ(now.clock, ClockKind::kSteady);
  EXPECT_LE(before, now.since_zero);
  EXPECT_LE(now.since_zero, after);
}

}  // namespace
}  // namespace twocone

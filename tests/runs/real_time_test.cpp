// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/real_time.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace twocone::runs {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

// Catches a count of late frames that includes those within the tolerance, which is a tenth of the period.
TEST(DescribeLateness, CountsWhatIsLaterThanATenthOfThePeriod) {
  EXPECT_EQ(describe_lateness({milliseconds(1), milliseconds(6), milliseconds(7), milliseconds(40), milliseconds(2)},
                              RealTime::Milliseconds(60)),
            "2 of 5 late, median 6.00 ms, worst 40.00 ms");
  EXPECT_EQ(describe_lateness({}, RealTime::Milliseconds(60)), "none");
}

// Catches a pace that ends early, and a late frame that moves those after it.
TEST(RealTime, FramesAreDueOnOneGrid) {
  const std::atomic<bool> stop = false;
  RealTime real_time(milliseconds(40));
  const auto begin = RealTime::Clock::now();
  real_time.wait(stop);
  std::this_thread::sleep_for(milliseconds(100));  // the next two are late, the third is due at 120 ms
  for (int i = 0; i < 3; ++i) real_time.wait(stop);
  EXPECT_GE(RealTime::Clock::now() - begin, milliseconds(120));
  const std::string report = real_time.report();
  EXPECT_THAT(report, HasSubstr("of 4 late"));
  EXPECT_THAT(report, HasSubstr("of a thread that only sleeps: "));
}

TEST(RealTime, AStopEndsTheWait) {
  std::atomic<bool> stop = false;
  RealTime real_time(std::chrono::hours(1));
  real_time.wait(stop);
  stop = true;
  real_time.wait(stop);
  EXPECT_NE(real_time.report(), "");
}

}  // namespace
}  // namespace twocone::runs

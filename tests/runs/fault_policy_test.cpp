// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/frame_taker.h"

#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace twocone::runs {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

const Error kGone{ErrorCode::kDisconnected, "lower: it went away"};
const Error kDamaged{ErrorCode::kBadData, "lower: it came damaged"};

class FaultPolicyTest : public testing::Test {
 protected:
  FaultPolicy fault_policy(std::chrono::milliseconds patience) {
    return {patience, [this](const std::string& line) { told_.push_back(line); }};
  }
  std::vector<std::string> told_;
};

TEST_F(FaultPolicyTest, WithoutPatienceTheFirstFailureIsTheLast) {
  FaultPolicy none = fault_policy(0ms);
  const Status status = none.failed(7, kGone);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(status.error().message, "frame 7: lower: it went away");
  EXPECT_THAT(told_, IsEmpty());
}

TEST_F(FaultPolicyTest, ItsBeginAndItsEndAreToldOnce) {
  FaultPolicy long_one = fault_policy(1h);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(long_one.failed(7, kGone));
  long_one.over(8);
  long_one.over(9);
  EXPECT_THAT(told_, ElementsAre("frame 7: lower: it went away: the wheels are stopped until it answers again",
                                 StartsWith("frame 8: all is well again after ")));
}

TEST_F(FaultPolicyTest, DamagedFramesHaveNoEndToTell) {
  FaultPolicy long_one = fault_policy(1h);
  EXPECT_TRUE(long_one.failed(7, kDamaged));
  EXPECT_TRUE(long_one.failed(7, kDamaged));
  long_one.over(8);
  EXPECT_THAT(told_, ElementsAre("frame 7: lower: it came damaged"));
  EXPECT_TRUE(long_one.failed(9, kDamaged));
  EXPECT_TRUE(long_one.failed(9, kGone)) << "what begins as damage may become worse";
  long_one.over(10);
  EXPECT_THAT(told_, ElementsAre("frame 7: lower: it came damaged", "frame 9: lower: it came damaged",
                                 HasSubstr("frame 9: lower: it went away"), StartsWith("frame 10: all is well")));
}

TEST_F(FaultPolicyTest, OneThatLastsEndsTheRun) {
  FaultPolicy short_one = fault_policy(20ms);
  EXPECT_TRUE(short_one.failed(7, kGone));
  std::this_thread::sleep_for(25ms);
  const Status status = short_one.failed(7, kGone);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().message, "frame 7: lower: it went away, and so it stayed for 0.02 s");
  EXPECT_EQ(status.error().code, ErrorCode::kDisconnected);
}

TEST_F(FaultPolicyTest, OneThatIsOverBeginsAnew) {
  FaultPolicy short_one = fault_policy(20ms);
  EXPECT_TRUE(short_one.failed(7, kDamaged));
  short_one.over(8);
  std::this_thread::sleep_for(25ms);
  EXPECT_TRUE(short_one.failed(9, kDamaged)) << "the patience counts from this one on";
}

}  // namespace
}  // namespace twocone::runs

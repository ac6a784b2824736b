// SPDX-License-Identifier: Apache-2.0
#include "hal/result.h"

#include <memory>
#include <set>

#include <gtest/gtest.h>

namespace twocone {
namespace {

TEST(Result, HoldsAValueOrAnError) {
  const Result<int> value = 41;
  ASSERT_TRUE(value.has_value());
  EXPECT_TRUE(static_cast<bool>(value));
  EXPECT_EQ(*value, 41);

  const Result<int> none = Error{ErrorCode::kTimeout, "too late"};
  ASSERT_FALSE(none.has_value());
  EXPECT_FALSE(static_cast<bool>(none));
  EXPECT_EQ(none.error().code, ErrorCode::kTimeout);
  EXPECT_EQ(none.error().message, "too late");
}

// Catches a Result that copies its value instead of moving it: devices cannot be copied.
TEST(Result, ReturnsAMoveOnlyValue) {
  Result<std::unique_ptr<int>> result = std::make_unique<int>(17);
  EXPECT_EQ(**result, 17);
  const std::unique_ptr<int> taken = *std::move(result);
  ASSERT_TRUE(taken);
  EXPECT_EQ(*taken, 17);
}

TEST(Result, OfTextThatNamesAnErrorIsAValue) {
  const Result<std::string> value = std::string("Timeout");
  EXPECT_TRUE(value.has_value());
  EXPECT_EQ(value->size(), 7U);
}

TEST(Status, IsSuccessByDefault) {
  const Status done;
  EXPECT_TRUE(done.has_value());
  const Status refused = Error{ErrorCode::kRefused, "because"};
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_EQ(refused.error().message, "because");
}

TEST(ErrorCode, EachHasItsOwnName) {
  const ErrorCode all[] = {ErrorCode::kNotFound, ErrorCode::kUnavailable,  ErrorCode::kInvalidState,
                           ErrorCode::kTimeout,  ErrorCode::kDisconnected, ErrorCode::kBadData,
                           ErrorCode::kRefused};
  std::set<std::string_view> names;
  for (const ErrorCode code : all) names.insert(to_string(code));
  EXPECT_EQ(names, (std::set<std::string_view>{"NotFound", "Unavailable", "InvalidState", "Timeout", "Disconnected",
                                               "BadData", "Refused"}));
}

#ifndef NDEBUG
TEST(ResultDeathTest, UseOfTheMissingAlternativeIsABug) {
  const Result<int> none = Error{ErrorCode::kTimeout, "too late"};
  EXPECT_DEATH((void)none.value(), "has_value");
  const Result<int> value = 41;
  EXPECT_DEATH((void)value.error(), "has_value");
}
#endif

}  // namespace
}  // namespace twocone

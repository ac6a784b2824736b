// SPDX-License-Identifier: Apache-2.0
#include "hal/image.h"

#include <gtest/gtest.h>

#include <array>
#include <utility>

namespace twocone {
namespace {

/// A driver's buffer, with a flag for whether it was given back.
struct Buffer {
  std::array<std::uint8_t, 3> memory{7, 8, 9};
  bool is_back = false;

  Bytes lend() {
    return Bytes::lent(memory, {memory.data(), [this](const void*) { is_back = true; }});
  }
};

TEST(Bytes, OwnBytesAreAVector) {
  const std::vector<std::uint8_t> vector{1, 2, 3};
  Bytes bytes = vector;
  EXPECT_FALSE(bytes.is_lent());
  EXPECT_EQ(bytes, Bytes(vector.begin(), vector.end()));
  bytes.push_back(4);
  bytes.resize(5);
  bytes[0] = 9;
  EXPECT_EQ(bytes, (Bytes{9, 2, 3, 4, 0}));
  bytes = Bytes(vector.begin(), vector.begin() + 1);
  EXPECT_EQ(bytes, Bytes{1});
  EXPECT_FALSE(bytes.empty());
  EXPECT_TRUE(Bytes().empty());
}

// Catches an unnecessary copy: lent bytes are read in the driver's memory.
TEST(Bytes, LentBytesAreReadInPlace) {
  Buffer buffer;
  const Bytes bytes = buffer.lend();
  EXPECT_TRUE(bytes.is_lent());
  EXPECT_EQ(bytes.data(), buffer.memory.data());
  EXPECT_EQ(bytes.size(), 3u);
  EXPECT_EQ(bytes[2], 9);
  EXPECT_EQ(bytes, (Bytes{7, 8, 9})) << "the owner is not part of the value";
  EXPECT_NE(bytes, (Bytes{7, 8}));
}

TEST(Bytes, LentBytesGoBackWithTheLastCopy) {
  Buffer buffer;
  {
    Bytes kept;
    {
      const Bytes bytes = buffer.lend();
      kept = bytes;
    }
    EXPECT_FALSE(buffer.is_back) << "a copy is still in use";
    EXPECT_EQ(std::as_const(kept).data(), buffer.memory.data());
    const Bytes moved = std::move(kept);
    EXPECT_FALSE(buffer.is_back) << "moved, not given back";
    EXPECT_EQ(moved.size(), 3u);
  }
  EXPECT_TRUE(buffer.is_back);
}

// Catches a write into the device's memory, and a buffer that is not given back although it is no longer in use.
TEST(Bytes, AWriteMakesACopy) {
  Buffer buffer;
  Bytes bytes = buffer.lend();
  bytes[1] = 0;
  EXPECT_FALSE(bytes.is_lent());
  EXPECT_TRUE(buffer.is_back);
  EXPECT_EQ(bytes, (Bytes{7, 0, 9}));
  EXPECT_EQ(buffer.memory[1], 8);
}

TEST(Bytes, AWriteLeavesOtherCopiesUnchanged) {
  Buffer buffer;
  const Bytes other = buffer.lend();
  Bytes bytes = other;
  bytes.push_back(10);
  EXPECT_FALSE(buffer.is_back);
  EXPECT_TRUE(other.is_lent());
  EXPECT_EQ(other, (Bytes{7, 8, 9}));
  EXPECT_EQ(bytes, (Bytes{7, 8, 9, 10}));
}

TEST(Bytes, ReplacedBytesGoBack) {
  Buffer buffer;
  Bytes bytes = buffer.lend();
  bytes = {1};
  EXPECT_TRUE(buffer.is_back);
  EXPECT_FALSE(bytes.is_lent());
  EXPECT_EQ(bytes, Bytes{1});
}

TEST(Bytes, MovedFromAreEmpty) {
  Buffer buffer;
  Bytes lent = buffer.lend();
  Bytes own{1, 2};
  const Bytes elsewhere[] = {std::move(lent), std::move(own)};
  EXPECT_TRUE(lent.empty());  // NOLINT(bugprone-use-after-move): this use is the purpose of the test
  EXPECT_TRUE(own.empty());   // NOLINT(bugprone-use-after-move)
  EXPECT_EQ(elsewhere[0].size() + elsewhere[1].size(), 5u);
}

}  // namespace
}  // namespace twocone

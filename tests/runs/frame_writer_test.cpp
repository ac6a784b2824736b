// SPDX-License-Identifier: Apache-2.0
// Frames that are stored in a thread of their own: order, room, failures, and the end.
#include "apps/runs/loop/frame_writer.h"

#include <atomic>
#include <future>
#include <vector>

#include <gtest/gtest.h>

#include "apps/runlog/storage/disk.h"
#include "base/log.h"
#include "tests/support/error_of.h"

namespace twocone::runs {
namespace {

using testing_support::error_of;

FinishedFrame frame(std::uint64_t number) {
  FinishedFrame result;
  result.record.frame.frame = number;
  return result;
}

std::vector<std::uint64_t> numbers(std::uint64_t count) {
  std::vector<std::uint64_t> result;
  for (std::uint64_t i = 0; i < count; ++i) result.push_back(i);
  return result;
}

// Catches frames that are dropped when the loop ends by an exception or a signal, and tables out of order.
TEST(FrameWriter, StoresAllFramesInOrderBeforeItIsDestroyed) {
  std::vector<std::uint64_t> stored;
  {
    FrameWriter writer([&](const FinishedFrame& finished) { stored.push_back(finished.record.frame.frame); });
    for (std::uint64_t i = 0; i < 100; ++i) writer.add(frame(i));
  }
  EXPECT_EQ(stored, numbers(100));
}

// Catches results that are computed from tables of which the end is missing.
TEST(FrameWriter, FinishWaitsForTheLastFrame) {
  std::promise<void> may_store;
  std::atomic<int> stored{0};
  FrameWriter writer([&, go = may_store.get_future().share()](const FinishedFrame&) {
    go.wait();
    ++stored;
  });
  for (std::uint64_t i = 0; i < 3; ++i) writer.add(frame(i));
  auto finished = std::async(std::launch::async, [&] { writer.finish(); });
  EXPECT_EQ(finished.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout);
  may_store.set_value();
  finished.get();
  EXPECT_EQ(stored, 3);
}

// Catches a queue that grows until the memory is used up while a disk is slow.
TEST(FrameWriter, TakesNoMoreFramesThanItHasRoomFor) {
  std::promise<void> may_store;
  FrameWriter writer([go = may_store.get_future().share()](const FinishedFrame&) { go.wait(); });
  std::atomic<std::size_t> added{0};
  auto adding = std::async(std::launch::async, [&] {
    for (std::uint64_t i = 0; i < 2 * FrameWriter::kMostWaiting; ++i, ++added) writer.add(frame(i));
  });
  EXPECT_EQ(adding.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  EXPECT_EQ(added, FrameWriter::kMostWaiting);
  may_store.set_value();
  adding.get();
}

// Catches a failure that is lost, and a row of a later frame after one that is missing.
TEST(FrameWriter, AFailureIsReportedAndNothingAfterItIsStored) {
  std::vector<std::uint64_t> stored;
  {
    FrameWriter writer([&](const FinishedFrame& finished) {
      if (finished.record.frame.frame == 2) throw runlog::DiskError("cannot write {}", "000002.png");
      stored.push_back(finished.record.frame.frame);
    });
    EXPECT_EQ(error_of<runlog::DiskError>([&] {
                for (std::uint64_t i = 0; i < 3 + FrameWriter::kMostWaiting; ++i) writer.add(frame(i));
                writer.finish();
              }),
              "cannot write 000002.png");
  }
  EXPECT_EQ(stored, numbers(2));
  for (const std::string& line : base::close_log()) {
    EXPECT_EQ(line.find("000002.png"), std::string::npos) << "reported twice: " << line;
  }
}

// Catches a failure of the last frames while the loop already ends for another reason.
TEST(FrameWriter, AFailureThatNobodyAskedForIsLogged) {
  (void)base::close_log();
  {
    FrameWriter writer([](const FinishedFrame&) { throw runlog::DiskError("cannot write {}", "000009.png"); });
    writer.add(frame(9));
  }
  const auto lines = base::close_log();
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].find("cannot write 000009.png"), std::string::npos) << lines[0];
}

}  // namespace
}  // namespace twocone::runs

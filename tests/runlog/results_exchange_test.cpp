// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/results_exchange.h"

#include <gtest/gtest.h>

#include "apps/runlog/storage/disk.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runlog {
namespace {

using testing_support::TemporaryFolder;

/// Replaces kill -9: leaves everything as it is on the disk.
struct Killed {};

/// Ends the program before its nth change of the disk.
std::function<void()> killed_before(int& steps_left) {
  return [&steps_left] {
    if (steps_left-- == 0) throw Killed{};
  };
}

class ResultsInTwoStates : public testing::TestWithParam<Exchange> {
 protected:
  /// The old results are of method outline, with sightings. The new ones are of method paper, without sightings, and
  /// shorter.
  void SetUp() override {
    put("outline", "old",
        {"ranges.csv", "fixes.csv", "sightings.csv", "timing.csv", "estimate.tum", "track.csv", "summary.json"});
    put("paper", "old paper", {"ranges.csv", "fixes.csv", "timing.csv", "estimate.tum", "track.csv", "summary.json"});
    ResultsExchange exchange(run_, "outline");
    fill(exchange.stage(), "old",
         {"ranges.csv", "fixes.csv", "sightings.csv", "timing.csv", "estimate.tum", "track.csv"});
    exchange.commit(OnTop::kYes);
  }

  void put(const std::string& method, const std::string& text, const std::vector<const char*>& names) const {
    std::filesystem::create_directories(run_ / "methods" / method);
    fill(run_ / "methods" / method, text, names);
  }
  static void fill(const std::filesystem::path& folder, const std::string& text,
                   const std::vector<const char*>& names) {
    for (const char* const name : names) write_whole(folder / name, text);
  }
  /// Returns false if the program was killed.
  [[nodiscard]] bool replaced(int steps) const {
    try {
      ResultsExchange exchange(run_, "paper");
      fill(exchange.stage(), "new", {"ranges.csv", "fixes.csv", "timing.csv", "estimate.tum", "track.csv"});
      exchange.commit(OnTop::kYes, GetParam(), killed_before(steps));
      return true;
    } catch (const Killed&) {
      return false;
    }
  }
  /// Returns the content of each file in `folder`, in the order of kResultFiles.
  [[nodiscard]] std::string content(const std::filesystem::path& folder) const {
    std::string all;
    for (const char* const name : kResultFiles) {
      const auto file = std::filesystem::relative(folder / name, temporary_.path());
      all += std::filesystem::exists(folder / name) ? temporary_.read(file.string()) + ";" : "-;";
    }
    return all;
  }

  static constexpr const char* kOld = "old;old;old;-;old;old;old;-;";
  static constexpr const char* kOldPaper = "old paper;old paper;-;-;old paper;old paper;old paper;old paper;";
  static constexpr const char* kNew = "new;new;-;-;new;new;new;-;";

  const TemporaryFolder temporary_;
  const std::filesystem::path run_ = temporary_.path() / "run";
};

// Catches a mixture of two methods' tables, missing tables, and remaining files.
TEST_P(ResultsInTwoStates, AKillAtAnyStepLeavesOneOfThem) {
  ASSERT_EQ(content(run_), kOld);
  int kills = 0;
  bool was_new = false;
  for (; !replaced(kills); ++kills) {
    const std::string seen = content(top_results(run_));  // by a reader before any writer
    EXPECT_TRUE(seen == kOld || seen == kNew) << "killed before step " << kills << ": " << seen;
    complete_exchanges(run_);
    const std::string after = content(run_);
    EXPECT_EQ(after, seen) << "killed before step " << kills;
    EXPECT_EQ(content(run_ / "methods" / "paper"), after == kNew ? kNew : kOldPaper) << kills;
    EXPECT_EQ(content(run_ / "methods" / "outline"), kOld) << kills;
    int entries = 0;
    for (const auto& entry : std::filesystem::directory_iterator(run_ / "methods")) entries += entry.exists();
    EXPECT_EQ(entries, 2) << "killed before step " << kills << ": something remains in methods/";
    was_new = was_new || after == kNew;
    std::filesystem::remove_all(run_);
    SetUp();
    ASSERT_LT(kills, 100) << "it never ends";
  }
  EXPECT_EQ(content(run_), kNew);
  EXPECT_TRUE(was_new) << "no kill was after the commit";
  EXPECT_GE(kills, 8) << "the journal, the exchange, each file at the top, the removal";
}

// Catches a completion that a second kill leaves incomplete.
TEST_P(ResultsInTwoStates, TheCompletionMayBeKilledToo) {
  for (int first = 1; !replaced(first); ++first) {
    for (int second = 0;; ++second) {
      int steps = second;
      try {
        complete_exchanges(run_, killed_before(steps));
        break;
      } catch (const Killed&) {
        EXPECT_EQ(content(top_results(run_)), kNew) << first << ", " << second;
      }
      ASSERT_LT(second, 100) << "it never ends";
    }
    EXPECT_EQ(content(run_), kNew) << first;
    std::filesystem::remove_all(run_);
    SetUp();
  }
}

INSTANTIATE_TEST_SUITE_P(Both, ResultsInTwoStates, testing::Values(Exchange::kAtomic, Exchange::kTwoRenames),
                         [](const auto& tested) {
                           return tested.param == Exchange::kAtomic ? std::string("Atomic") : std::string("TwoRenames");
                         });

TEST(ResultsExchange, WithoutACommitNothingHasHappened) {
  const TemporaryFolder folder;
  {
    ResultsExchange first(folder.path(), "outline");
    write_whole(first.stage() / "ranges.csv", "old");
    first.commit(OnTop::kYes);
  }
  const std::string before = results_state(folder.path());
  {
    const ResultsExchange second(folder.path(), "outline");
    write_whole(second.stage() / "ranges.csv", "new");
    EXPECT_EQ(results_state(folder.path()), before) << "a stage does not change the state";
  }
  EXPECT_EQ(results_state(folder.path()), before);
  EXPECT_EQ(folder.read("methods/outline/ranges.csv"), "old");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "methods" / ".outline.new"));
  ResultsExchange third(folder.path(), "outline");
  third.commit(OnTop::kNo);
  EXPECT_NE(results_state(folder.path()), before) << "a reader would not notice that it read two states";
}

}  // namespace
}  // namespace twocone::runlog

// SPDX-License-Identifier: Apache-2.0
#include "bench/many_frames.h"

#include <fstream>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace twocone::bench {
namespace {

constexpr int kFrames = 6;
/// Twenty times the rmse of 2000 frames of twice the size, 1.1 mm: wrong poses, units or images give decimetres.
constexpr double kMostError_m = 0.022;

ManyFramesOptions options(std::filesystem::path rows, int threads) {
  return {.frames = kFrames, .seed = 3, .threads = threads, .rows = std::move(rows)};
}

TEST(ManyFrames, AreTheSameAgainAndAfterAnInterruption) {
  const testing_support::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "rows.csv";
  // Of half the size, so that the mirrors are found in a quarter of the time.
  const auto robot = config::scaled(config::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml"), 0.5);
  const auto records = take_frames(robot, options(file, 2));
  ASSERT_EQ(records.size(), std::size_t(kFrames));
  const FixStatistics statistics = statistics_of(records);
  EXPECT_GE(statistics.with_fix, kFrames - 1);
  EXPECT_EQ(statistics.with_bound, statistics.with_fix);
  EXPECT_GT(statistics.bound_rms_m, 0);
  EXPECT_LT(statistics.max_m, kMostError_m);

  const auto taken_again = [&](int threads) {
    int taken = 0;
    ManyFramesOptions again = options(file, threads);
    again.progress = [&](int frames) { taken += frames; };
    EXPECT_EQ(take_frames(robot, again), records);
    return taken;
  };
  EXPECT_EQ(taken_again(1), 0) << "the file holds them";
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 5);
  EXPECT_EQ(taken_again(1), kFrames) << "half a block is taken again";

  ManyFramesOptions others = options(file, 1);
  others.seed = 4;
  EXPECT_THROW(take_frames(robot, others), std::runtime_error);
  ManyFramesOptions fewer = options(file, 1);
  fewer.frames = kFrames - 1;
  EXPECT_THROW(take_frames(robot, fewer), std::runtime_error) << "rows would be lost";
  EXPECT_EQ(taken_again(1), 0);
}

TEST(ManyFrames, StatisticsOfKnownErrors) {
  const FixStatistics s =
      statistics_of({{.frame = 0, .verdict = "ok", .error_m = 0.003, .in_ellipse = true, .bound_m = 0.002},
                     {.frame = 1, .verdict = "ok", .error_m = 0.004, .in_ellipse = false},
                     {.frame = 2, .verdict = "weak", .bound_m = 0.1}});
  EXPECT_EQ(s.with_fix, 2);
  EXPECT_DOUBLE_EQ(s.mean_m, 0.0035);
  EXPECT_DOUBLE_EQ(s.rmse_m, std::sqrt(0.5 * (9e-6 + 16e-6)));
  EXPECT_DOUBLE_EQ(s.coverage, 0.5);
  EXPECT_EQ(s.with_bound, 1);
  EXPECT_DOUBLE_EQ(s.bound_rms_m, 0.002);
  EXPECT_DOUBLE_EQ(s.rmse_of_bounded_m, 0.003);
}

}  // namespace
}  // namespace twocone::bench

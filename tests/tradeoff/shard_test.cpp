// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/shard.h"

#include <fstream>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "apps/tradeoff/run_shards.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value.h"
#include "tests/tradeoff/lab.h"

namespace twocone::tradeoff {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::ThrowsMessage;
using twocone::testing_support::TemporaryFolder;
using twocone::testing_support::value;

/// Returns a plan with two small sets of images of the lab, each with two episodes in a shard of its own, and three
/// settings for them.
struct Small : Lab {
  Plan plan = make_plan(robot, map, {.episodes = 3});

  Small() {
    plan.settings.clear();
    plan.shards.clear();
    for (const Effects effects : {Effects::kScene, Effects::kNoise}) {
      const Images images{320, 240, 1, effects};
      Setting setting{.images = images, .landmarks = 6, .rate_hz = plan.robot_rate_hz};
      plan.settings.push_back(setting);
      setting.frames = kStepsOfEpisode;
      plan.settings.push_back(setting);
      setting.frames = 1;
      setting.level = Level::kPaper;
      plan.settings.push_back(setting);
      for (int episode = 0; episode < 2; ++episode) plan.shards.push_back({images, episode, 1});
    }
  }

  [[nodiscard]] ShardRecord run(const RunShard& runner, std::size_t shard) const {
    std::atomic<bool> stop = false;
    return value(runner(
        shard, [](double) {}, stop));
  }
};

/// Compares everything except times and memory.
void expect_same(const ShardRecord& a, const ShardRecord& b) {
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    const auto without_times = [](const FrameRow& r) {
      return std::tie(r.setting, r.episode, r.step, r.verdict, r.error_m, r.heading_error_rad, r.in_ellipse, r.bound_m);
    };
    EXPECT_EQ(without_times(a.frames[i]), without_times(b.frames[i]));
  }
  ASSERT_EQ(a.ranges.size(), b.ranges.size());
  for (std::size_t i = 0; i < a.ranges.size(); ++i) EXPECT_EQ(a.ranges[i].error_m, b.ranges[i].error_m);
}

TEST(Shard, IsTheSameAfterOthersAndAlone) {
  const Small small;
  const RunShard all = shard_runner(small.robot, small.map, small.plan, {});
  std::vector<ShardRecord> in_order;
  for (std::size_t i = 0; i < small.plan.shards.size(); ++i) in_order.push_back(small.run(all, i));
  const RunShard backwards = shard_runner(small.robot, small.map, small.plan, {});
  for (std::size_t i : {3U, 1U}) expect_same(in_order[i], small.run(backwards, i));
}

TEST(Shard, ContainsTheAnswersOfItsSettings) {
  Small small;
  small.map.renderer = sim_povray::RendererKind::kPovray;  // it has a process, whose memory is known
  const RunShard runner = shard_runner(small.robot, small.map, small.plan, {});
  const ShardRecord record = small.run(runner, 1);
  // A single frame has one row. Several frames have one row each, of which the last is the answer.
  ASSERT_EQ(record.frames.size(), std::size_t(3 * kStepsOfEpisode));
  for (int i = 0; i < kStepsOfEpisode; ++i) {
    const FrameRow& single = record.frames[std::size_t(i)];
    EXPECT_EQ(single.setting, 0);
    EXPECT_EQ(single.episode, 1);
    EXPECT_EQ(single.step, i);
    ASSERT_TRUE(single.error_m);
    EXPECT_LT(*single.error_m, 0.02);  // 0.7 mm on average at this size
    EXPECT_GT(single.vision_s, 0);
    EXPECT_GT(single.localisation_s, 0);
    ASSERT_TRUE(single.bound_m);
    EXPECT_GT(*single.bound_m, 1e-5);
    const FrameRow& joined = record.frames[std::size_t(kStepsOfEpisode + i)];
    EXPECT_EQ(joined.verdict, i + 1 == kStepsOfEpisode ? "ok" : "");
    EXPECT_EQ(joined.error_m.has_value(), i + 1 == kStepsOfEpisode);
  }
  EXPECT_LT(*record.frames[2 * kStepsOfEpisode - 1].bound_m, *record.frames[kStepsOfEpisode - 1].bound_m);
  EXPECT_FALSE(record.frames.back().in_ellipse);  // method paper states no sigma
  ASSERT_EQ(record.renders.size(), std::size_t(kStepsOfEpisode));
  for (const RenderRow& row : record.renders) {
    EXPECT_EQ(row.episode, 1);
    EXPECT_GT(row.cpu_s, 1e-3);
  }
  ASSERT_EQ(record.render_memory.size(), 1U);
  EXPECT_GT(record.render_memory[0].peak_bytes, 1e6);
}

TEST(Shard, StopsOnRequest) {
  const Small small;
  const RunShard runner = shard_runner(small.robot, small.map, small.plan, {});
  std::atomic<bool> stop = true;
  const auto record = runner(
      0, [](double) {}, stop);
  ASSERT_FALSE(record);
  EXPECT_EQ(record.error().code, ErrorCode::kCancelled);
}

TEST(RunShards, EndsWhenStoppedAndContinuesWithWhatIsMissing) {
  const Small small;
  const TemporaryFolder place;
  const SweepFolder folder(place.path() / "sweep", small.robot, small.map, small.plan);
  const Subject subject{small.robot, small.map, small.plan};
  std::atomic<bool> stop = false;
  std::vector<double> shares;
  const Watch watch{[&](double share) {
                      shares.push_back(share);
                      stop = folder.missing().size() == 3;
                    },
                    [](const std::string&) {}};
  EXPECT_EQ(value(run_shards(subject, folder, folder.missing(), watch, stop)), 1U);
  EXPECT_EQ(folder.missing(), (std::vector<std::size_t>{1, 2, 3}));
  folder.add(2, {});  // as another program may
  stop = false;
  shares.clear();
  EXPECT_EQ(value(run_shards(subject, folder, {1, 2, 3}, watch, stop)), 3U);
  EXPECT_TRUE(folder.missing().empty());
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_DOUBLE_EQ(shares.back(), 1);
}

TEST(RunShards, NamesTheShardThatFails) {
  Small small;
  const TemporaryFolder place;
  const SweepFolder folder(place.path() / "sweep", small.robot, small.map, small.plan);
  small.map.scene = place.path() / "nowhere.pov";
  const Watch watch{[](double) {}, [](const std::string&) {}};
  const auto done = run_shards({small.robot, small.map, small.plan}, folder, {1, 2}, watch, false);
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, testing::StartsWith("shard 1: "));
  EXPECT_EQ(folder.missing().size(), 4U);
}

// ---- the folder of a sweep

struct SmallSweep : Lab {
  Plan plan = make_plan(robot, map, {.episodes = 3});
};

ShardRecord a_record(int setting) {
  ShardRecord record;
  FrameRow row;
  row.setting = setting;
  row.verdict = "ok";
  row.error_m = 0.1 / 3;
  row.in_ellipse = true;
  row.vision_s = 1.25e-3;
  record.frames = {row, {}};
  record.frames[1].verdict = "too_few";
  record.ranges = {{setting, 1, 2, 1e-300}};
  record.renders = {{setting, 1, 2, 0.5}};
  record.memory = {{setting, 1e9}};
  record.render_memory = {{setting, 2e9}};
  return record;
}

TEST(SweepFolder, ReturnsTheRowsThatWereAdded) {
  const SmallSweep lab;
  const TemporaryFolder folder;
  const SweepFolder sweep(folder.path(), lab.robot, lab.map, lab.plan);
  EXPECT_EQ(sweep.missing().size(), lab.plan.shards.size());
  for (std::size_t i = lab.plan.shards.size(); i-- > 0;) sweep.add(i, a_record(int(i)));
  EXPECT_TRUE(sweep.missing().empty());
  const ShardRecord all = sweep.read_all();
  ASSERT_EQ(all.frames.size(), 2 * lab.plan.shards.size());
  EXPECT_EQ(all.frames[2].setting, 1);
  EXPECT_EQ(all.frames[2].error_m, 0.1 / 3);
  EXPECT_EQ(all.frames[2].in_ellipse, true);
  EXPECT_EQ(all.frames[3].verdict, "too_few");
  EXPECT_FALSE(all.frames[3].error_m || all.frames[3].in_ellipse);
  EXPECT_EQ(all.ranges[1].error_m, 1e-300);
  EXPECT_EQ(all.renders[1].cpu_s, 0.5);
  EXPECT_EQ(all.render_memory[1].peak_bytes, 2e9);
}

TEST(SweepFolder, ContinuesItsOwnSweepAndRejectsAnother) {
  const SmallSweep lab;
  const TemporaryFolder folder;
  SweepFolder(folder.path(), lab.robot, lab.map, lab.plan).add(0, a_record(0));
  EXPECT_TRUE(SweepFolder(folder.path(), lab.robot, lab.map, lab.plan).has(0));
  const Plan other = make_plan(lab.robot, lab.map, {.seed = 2, .episodes = 3});
  EXPECT_THAT([&] { SweepFolder(folder.path(), lab.robot, lab.map, other); },
              ThrowsMessage<config::FileError>(HasSubstr("seed: 1' where this one has 'seed: 2'")));
}

TEST(SweepFolder, NamesWhatIsMissingOrDamaged) {
  const SmallSweep lab;
  const TemporaryFolder folder;
  const SweepFolder sweep(folder.path(), lab.robot, lab.map, lab.plan);
  for (std::size_t i = 0; i < lab.plan.shards.size(); ++i) {
    if (i != 3) sweep.add(i, a_record(int(i)));
  }
  const auto read = [&] { (void)sweep.read_all(); };
  EXPECT_THAT(read, ThrowsMessage<config::FileError>(AllOf(HasSubstr("1 of"), EndsWith(": 3"))));
  sweep.add(3, a_record(3));
  std::ofstream(folder.path() / "shards/0003/renders.csv", std::ios::app) << "3,1,2\n";
  EXPECT_THAT(read, ThrowsMessage<config::FileError>(HasSubstr("renders.csv:3: '3,1,2' is not a row")));
}

}  // namespace
}  // namespace twocone::tradeoff

// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/shard.h"

#include <gtest/gtest.h>

#include "apps/tradeoff/setting.h"
#include "tests/tradeoff/lab.h"

namespace twocone::tradeoff {
namespace {

/// Two small sets of pictures of the lab, two legs each in a shard of its own, three ways to look at them.
struct Small : Lab {
  Plan plan = make_plan(robot, map, {.legs = 3});

  Small() {
    plan.settings.clear();
    plan.shards.clear();
    for (const Effects effects : {Effects::kScene, Effects::kNoise}) {
      const Pictures pictures{320, 240, 1, effects};
      Setting setting{.pictures = pictures, .landmarks = 6, .rate_hz = plan.robot_rate_hz};
      plan.settings.push_back(setting);
      setting.frames = kInstants;
      plan.settings.push_back(setting);
      setting.frames = 1;
      setting.level = Level::kPaper;
      plan.settings.push_back(setting);
      for (int leg = 0; leg < 2; ++leg) plan.shards.push_back({pictures, leg, 1});
    }
  }

  [[nodiscard]] ShardRecord run(ShardRunner& runner, std::size_t shard) const {
    std::atomic<bool> stop = false;
    auto record = runner.run(
        shard, [](double) {}, stop);
    if (!record) throw std::runtime_error(record.error().message);
    return *std::move(record);
  }
};

/// All but times and memory.
void expect_same(const ShardRecord& a, const ShardRecord& b) {
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    EXPECT_EQ(a.frames[i].setting, b.frames[i].setting);
    EXPECT_EQ(a.frames[i].leg, b.frames[i].leg);
    EXPECT_EQ(a.frames[i].instant, b.frames[i].instant);
    EXPECT_EQ(a.frames[i].verdict, b.frames[i].verdict);
    EXPECT_EQ(a.frames[i].error_m, b.frames[i].error_m);
    EXPECT_EQ(a.frames[i].heading_error_rad, b.frames[i].heading_error_rad);
    EXPECT_EQ(a.frames[i].in_ellipse, b.frames[i].in_ellipse);
    EXPECT_EQ(a.frames[i].bound_m, b.frames[i].bound_m);
  }
  ASSERT_EQ(a.ranges.size(), b.ranges.size());
  for (std::size_t i = 0; i < a.ranges.size(); ++i) EXPECT_EQ(a.ranges[i].error_m, b.ranges[i].error_m);
}

TEST(Shard, ComesOutTheSameAfterOthersAndByItself) {
  const Small small;
  ShardRunner all(small.robot, small.map, small.plan, {});
  std::vector<ShardRecord> in_order;
  for (std::size_t i = 0; i < small.plan.shards.size(); ++i) in_order.push_back(small.run(all, i));
  ShardRunner backwards(small.robot, small.map, small.plan, {});
  for (std::size_t i : {3U, 1U}) expect_same(in_order[i], small.run(backwards, i));
}

TEST(Shard, HoldsWhatItsSettingsMade) {
  const Small small;
  ShardRunner runner(small.robot, small.map, small.plan, {});
  const ShardRecord record = small.run(runner, 1);
  // Single frames: a row each. Several: as many rows, of which the last is the answer.
  ASSERT_EQ(record.frames.size(), std::size_t(3 * kInstants));
  for (int i = 0; i < kInstants; ++i) {
    const FrameRow& single = record.frames[std::size_t(i)];
    EXPECT_EQ(single.setting, 0);
    EXPECT_EQ(single.leg, 1);
    EXPECT_EQ(single.instant, i);
    ASSERT_TRUE(single.error_m);
    EXPECT_LT(*single.error_m, 0.02);  // 0.7 mm on average at this size
    EXPECT_GT(single.vision_s, 0);
    EXPECT_GT(single.localisation_s, 0);
    ASSERT_TRUE(single.bound_m);
    EXPECT_GT(*single.bound_m, 1e-5);
    const FrameRow& joined = record.frames[std::size_t(kInstants + i)];
    EXPECT_EQ(joined.verdict, i + 1 == kInstants ? "ok" : "");
    EXPECT_EQ(joined.error_m.has_value(), i + 1 == kInstants);
  }
  EXPECT_LT(*record.frames[2 * kInstants - 1].bound_m, *record.frames[kInstants - 1].bound_m);
  EXPECT_FALSE(record.frames.back().in_ellipse);  // method paper states no sigma
  ASSERT_EQ(record.renders.size(), std::size_t(kInstants));
  for (const RenderRow& row : record.renders) {
    EXPECT_EQ(row.leg, 1);
    EXPECT_GT(row.cpu_s, 1e-3);
  }
  ASSERT_EQ(record.render_memory.size(), 1U);
  EXPECT_GT(record.render_memory[0].peak_bytes, 1e6);
}

TEST(Shard, StopsWhenTold) {
  const Small small;
  ShardRunner runner(small.robot, small.map, small.plan, {});
  std::atomic<bool> stop = true;
  const auto record = runner.run(
      0, [](double) {}, stop);
  ASSERT_FALSE(record);
  EXPECT_EQ(record.error().code, ErrorCode::kRefused);
}

}  // namespace
}  // namespace twocone::tradeoff

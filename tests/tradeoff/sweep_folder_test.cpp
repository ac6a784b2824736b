// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/shard.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/tradeoff/lab.h"

namespace twocone::tradeoff {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::ThrowsMessage;

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
  const twocone::testing_support::TemporaryFolder folder;
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
  const twocone::testing_support::TemporaryFolder folder;
  SweepFolder(folder.path(), lab.robot, lab.map, lab.plan).add(0, a_record(0));
  EXPECT_TRUE(SweepFolder(folder.path(), lab.robot, lab.map, lab.plan).has(0));
  const Plan other = make_plan(lab.robot, lab.map, {.seed = 2, .episodes = 3});
  EXPECT_THAT([&] { SweepFolder(folder.path(), lab.robot, lab.map, other); },
              ThrowsMessage<config::FileError>(HasSubstr("seed: 1' where this one has 'seed: 2'")));
}

TEST(SweepFolder, NamesWhatIsMissingOrDamaged) {
  const SmallSweep lab;
  const twocone::testing_support::TemporaryFolder folder;
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

// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/run.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "apps/runlog/storage/disk.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runs {
namespace {

const std::string kLab = TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml";
using namespace std::string_literals;

const std::string kMap = TWOCONE_SOURCE_DIR "/scenes/lab.map.yaml";

class OtherRobot : public testing::Test {
 protected:
  OtherRobot() {
    runlog::RunFolder run(from_);
    const Image dark{4, 3, PixelFormat::kRgb8, std::vector<std::uint8_t>(36, 7)};
    const Image light{4, 3, PixelFormat::kRgb8, std::vector<std::uint8_t>(36, 201)};
    for (const std::uint64_t frame : {0, 1}) {
      runlog::FrameRecord record;
      const double t_s = 0.1 * double(frame);
      record.frame.frame = frame;
      record.frame.t_s = t_s;
      // Straight on: with the lab's wheels of 0.05 m by 0.05 * 1.7 m.
      record.drive = {t_s, 17, 17, 1.7 * double(frame), 1.7 * double(frame)};
      record.truth = runlog::PoseRow{t_s, 0.0857 * double(frame), 0.001, 0.002};
      record.odometry = {t_s, 0.085 * double(frame), 0, 0};
      run.add(record, dark, light);
    }
    runlog::RunInfo info;
    info.method = "outline";
    info.events = {"it began"};
    runlog::write_run_yaml(from_, info, config::read_robot(kLab), kMap);
  }

  /// The lab's robot file with `old` as `now`.
  std::filesystem::path lab_but(const std::string& old, const std::string& now) {
    std::string text = config::read_text(kLab);
    for (const auto& [a, b] : {std::pair{old, now}, {std::string("../scenes/lab.map.yaml"), kMap}}) {
      const std::size_t at = text.find(a);
      EXPECT_NE(at, std::string::npos) << a;
      if (at != std::string::npos) text.replace(at, a.size(), b);
    }
    return temporary_.write("other.yaml", text);
  }

  const testing_support::TemporaryFolder temporary_;
  const std::filesystem::path from_ = temporary_.path() / "from";
  const std::filesystem::path to_ = temporary_.path() / "to";
};

TEST_F(OtherRobot, TakesTheImagesAndTheTruthButRigWheelsAndOdometryOfTheOther) {
  const std::string before = config::read_text(from_ / "run.yaml");
  auto file = lab_but("wheel_radius_m: 0.05\n", "wheel_radius_m: 0.0511\n");
  file = temporary_.write("both.yaml", config::read_text(file) + "max_skew_s: 0.0137\n");
  copy_run_with({file, {}}, from_, to_);

  const runlog::RunData run = runlog::read_run(to_);
  EXPECT_EQ(run.robot.file, file);
  EXPECT_EQ(run.robot.drive.wheel_radius_m, 0.0511);
  EXPECT_EQ(run.robot.max_skew_s, 0.0137);
  EXPECT_EQ(run.map.landmarks, runlog::read_run(from_).map.landmarks);
  ASSERT_EQ(run.frames.size(), 2U);
  ASSERT_EQ(run.truth.size(), 2U);
  EXPECT_EQ(run.truth[1].x_m, 0.0857);
  ASSERT_EQ(run.odometry.size(), 2U);
  // Tables have nine digits or more after the point.
  EXPECT_NEAR(run.odometry[1].x_m, 0.0511 * 1.7, 1e-9) << "m, of the wheels of the other file";
  EXPECT_EQ(config::read_text(runlog::lower_image_file(to_, 1)), config::read_text(runlog::lower_image_file(from_, 1)));
  EXPECT_EQ(config::read_text(runlog::upper_image_file(to_, 0)), config::read_text(runlog::upper_image_file(from_, 0)));
  ASSERT_EQ(run.info.events.size(), 2U);
  EXPECT_EQ(run.info.events[0], "it began");
  EXPECT_NE(run.info.events[1].find(file.string()), std::string::npos) << run.info.events[1];

  EXPECT_EQ(config::read_text(from_ / "run.yaml"), before) << "the run itself is left as it is";
}

TEST_F(OtherRobot, ThatCannotHaveMadeTheRunIsRefused) {
  EXPECT_THROW(copy_run_with({lab_but("width_px: 640", "width_px: 648"), {}}, from_, to_), config::FileError);
  EXPECT_THROW(copy_run_with({lab_but("start: {x_m: 0.0", "start: {x_m: 0.1"), {}}, from_, to_), config::FileError);
  EXPECT_THROW(copy_run_with({temporary_.path() / "none.yaml", {}}, from_, to_), config::FileError);
  EXPECT_FALSE(std::filesystem::exists(to_)) << "nothing is begun that is refused";
}

// A place of a landmark in the lab's map.
const std::string kPlace = "x_m: -2.45", kMovedPlace = "x_m: -2.46";

/// The text of the lab's map with a change.
std::string map_but(const std::string& old, const std::string& now) {
  std::string map = config::read_text(kMap);
  for (const auto& [what, with] :
       {std::pair{old, now}, {std::string("scene: lab.pov"), "scene: " TWOCONE_SOURCE_DIR "/scenes/lab.pov"s}}) {
    const std::size_t at = map.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    if (at != std::string::npos) map.replace(at, what.size(), with);
  }
  return map;
}

// Catches a robot file whose own map, such as one of calibrate, is silently left aside.
TEST_F(OtherRobot, BringsItsMapUnlessThatIsOfAnotherRoom) {
  std::string text = config::read_text(kLab);
  const std::string key = "map: ../scenes/lab.map.yaml";
  const auto naming = [&](const std::filesystem::path& map) {
    std::string changed = text;
    return temporary_.write("other.yaml", changed.replace(changed.find(key), key.size(), "map: " + map.string()));
  };
  const std::string hall = TWOCONE_SOURCE_DIR "/scenes/hall.map.yaml";
  EXPECT_THAT(testing_support::error_of<config::FileError>([&] {
                copy_run_with({naming(hall), {}}, from_, to_);
              }),
              testing::AllOf(testing::HasSubstr(hall + " has the landmarks"), testing::HasSubstr("--map")));
  EXPECT_FALSE(std::filesystem::exists(to_)) << "nothing is begun that is refused";

  const auto moved = temporary_.write("moved.map.yaml", map_but(kPlace, kMovedPlace));
  copy_run_with({naming(moved), {}}, from_, to_);
  const runlog::RunData run = runlog::read_run(to_);
  EXPECT_EQ(run.map.file, moved);
  EXPECT_EQ(run.map.landmarks, config::read_map(moved).landmarks);
  EXPECT_TRUE(run.robot.changes.empty()) << "the file itself names that map";
  EXPECT_THAT(run.info.events.back(), testing::HasSubstr(moved.string()));
}

TEST_F(OtherRobot, AMapMayBeOtherAndLaterCommandsNameItToo) {
  const auto moved = temporary_.write("moved.map.yaml", map_but(kPlace, kMovedPlace));
  copy_run_with({{}, moved}, from_, to_);
  const runlog::RunData run = runlog::read_run(to_);
  EXPECT_EQ(run.map.landmarks, config::read_map(moved).landmarks);
  EXPECT_NE(run.map.landmarks, runlog::read_run(from_).map.landmarks);
  EXPECT_EQ(run.robot.file, runlog::read_run(from_).robot.file);
  EXPECT_EQ(run.robot.map, moved);
  EXPECT_EQ(run.robot.changes, (std::vector<config::KeyChange>{{"map", moved.string()}}));
  EXPECT_EQ(run.odometry.size(), 2U);

  // Of another room, because it was asked for.
  copy_run_with({{}, TWOCONE_SOURCE_DIR "/scenes/hall.map.yaml"}, from_, to_, true);
  EXPECT_EQ(runlog::read_run(to_).map.landmarks,
            config::read_map(TWOCONE_SOURCE_DIR "/scenes/hall.map.yaml").landmarks);
  EXPECT_THROW(copy_run_with({{}, temporary_.path() / "none.map.yaml"}, from_, to_, true), config::FileError);
}

TEST_F(OtherRobot, NoRunIsLostToAnother) {
  EXPECT_THROW(copy_run_with({kLab, {}}, from_, from_), runlog::DiskError);
  copy_run_with({kLab, {}}, from_, to_);
  EXPECT_THROW(copy_run_with({kLab, {}}, from_, to_), runlog::DiskError);
}

}  // namespace
}  // namespace twocone::runs

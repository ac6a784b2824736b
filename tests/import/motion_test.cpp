// SPDX-License-Identifier: Apache-2.0
#include "apps/import/motion.h"

#include <cmath>
#include <numbers>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::importer {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing_support::error_of;

constexpr localisation::WheelGeometry kWheels{0.0317, 0.271};

Stamp at_s(double seconds) { return Stamp(std::llround(seconds * 1e9)); }

class Motion : public testing::Test {
 protected:
  WheelFile wheels(const std::string& text) const { return {folder_.write("odometry.csv", text), kWheels}; }
  Trajectory trajectory(const std::string& text) const { return Trajectory(folder_.write("mocap.tum", text)); }
  std::string refusal_of_wheels(const std::string& text) {
    return error_of<config::FileError>([&] { (void)wheels(text); });
  }
  std::string refusal_of_trajectory(const std::string& text) {
    return error_of<config::FileError>([&] { (void)trajectory(text); });
  }

  const testing_support::TemporaryFolder folder_;
};

TEST_F(Motion, WheelsTurnEvenlyBetweenReadings) {
  const WheelFile file = wheels("t_s,left_rad,right_rad\n10.1,1.5,-2\n10.3,1.7,-3\n");
  const auto turns = file.at(at_s(10.15));
  ASSERT_TRUE(turns);
  EXPECT_DOUBLE_EQ(turns->left_rad, 1.55);
  EXPECT_DOUBLE_EQ(turns->right_rad, -2.25);
  EXPECT_DOUBLE_EQ(file.at(at_s(10.3))->left_rad, 1.7);
  EXPECT_THAT(file.events(), IsEmpty());
}

TEST_F(Motion, ThereIsNoAnswerBeyondTheEndsOrInAGap) {
  const WheelFile file = wheels("t_s,left_rad,right_rad\n0,0,0\n0.1,1,1\n0.2,2,2\n3.2,3,3\n3.3,4,4\n");
  EXPECT_TRUE(file.at(at_s(-0.0004))) << "rounded in the file";
  EXPECT_FALSE(file.at(at_s(-0.0006)));
  EXPECT_FALSE(file.at(at_s(3.3006)));
  EXPECT_FALSE(file.at(at_s(1.7))) << "three seconds without a reading";
  EXPECT_TRUE(file.at(at_s(0.2)));
  EXPECT_TRUE(file.at(at_s(3.2)));
}

TEST_F(Motion, ColumnsStandInAnyOrderAmongOthers) {
  // A run's own drive.csv is such a file.
  const WheelFile drive =
      wheels("t_s,left_command_radps,right_command_radps,left_rad,right_rad\n0,7,7,1,2\n1,7,7,3,6\n");
  EXPECT_DOUBLE_EQ(drive.at(at_s(0.5))->left_rad, 2);
  const WheelFile swapped = wheels("right_rad,left_rad,t_s\n2,1,0\n6,3,1\n");
  EXPECT_DOUBLE_EQ(swapped.at(at_s(0.5))->right_rad, 4);
}

TEST_F(Motion, WheelsOfPosesDriveThesePoses) {
  // Drives forward and back on arcs from random wheels, with turns on the spot and headings past pi.
  std::mt19937 random(20061);
  std::uniform_real_distribution<double> step_m(-0.09, 0.11);
  std::vector<localisation::Pose> poses{{0.3, -1.7, 2.9}};
  for (int i = 0; i < 200; ++i) {
    poses.push_back(localisation::drive_arc(poses.back(), step_m(random), step_m(random), kWheels.separation_m));
  }
  poses.push_back(localisation::drive_arc(poses.back(), -0.0713, 0.0713, kWheels.separation_m));
  const WheelsOfPoses found = wheels_of(poses, kWheels);
  ASSERT_EQ(found.turns.size(), poses.size());
  // The rounding of the steps adds up over 200 steps of metres: 200 x 2^-52 x some metres.
  constexpr double kRounding = 1e-12;
  EXPECT_LT(found.sideways_m, kRounding);
  localisation::Odometry odometry(kWheels, poses.front());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const localisation::Pose& pose = odometry.update(found.turns[i].left_rad, found.turns[i].right_rad);
    ASSERT_NEAR(pose.x_m, poses[i].x_m, kRounding) << i;
    ASSERT_NEAR(pose.y_m, poses[i].y_m, kRounding) << i;
    ASSERT_NEAR(localisation::wrap_angle_rad(pose.heading_rad - poses[i].heading_rad), 0, kRounding) << i;
  }
}

TEST_F(Motion, PosesThatNoWheelsDriveAreReported) {
  EXPECT_THAT(wheels("t_s,x_m,y_m,heading_rad\n0,0,0,0\n1,0.2,0,0\n").events(),
              ElementsAre(HasSubstr("contains poses")));
  // With a heading in degrees, the robot seems to move sideways.
  EXPECT_THAT(wheels("t_s,x_m,y_m,heading_rad\n0,0,0,90\n1,0,0.2,90\n").events(),
              ElementsAre(HasSubstr("contains poses"), HasSubstr("sideways")));
}

TEST_F(Motion, WrongOdometryIsRefusedWithItsLine) {
  EXPECT_THAT(refusal_of_wheels(""), HasSubstr("odometry.csv:1: is empty"));
  EXPECT_THAT(refusal_of_wheels("time,l,r\n"), HasSubstr("odometry.csv:1: the header is 'time,l,r', must have t_s,"));
  EXPECT_THAT(refusal_of_wheels("t_s,left_rad,right_rad\n0,1\n1,2,3\n"), HasSubstr("csv:2: has 2 fields, must have 3"));
  EXPECT_THAT(refusal_of_wheels("t_s,left_rad,right_rad\n0,1,x\n"), HasSubstr("csv:2: right_rad is 'x'"));
  EXPECT_THAT(refusal_of_wheels("t_s,left_rad,right_rad\n0,nan,1\n"), HasSubstr("csv:2: left_rad is 'nan'"));
  EXPECT_THAT(refusal_of_wheels("t_s,left_rad,right_rad\nnow,1,1\n"), HasSubstr("csv:2: t_s is 'now'"));
  EXPECT_THAT(refusal_of_wheels("t_s,left_rad,right_rad\n1,0,0\n1,0,0\n"), HasSubstr("csv:3: t_s is 1, must be later"));
  EXPECT_THAT(refusal_of_wheels("t_s,left_rad,right_rad\n1,0,0\n"), HasSubstr("has 1 times, must have 2 or more"));
  EXPECT_EQ(wheels("t_s,left_rad,right_rad\n1,0,0\n2,1,1\n3,").timeline().last(), at_s(2)) << "half-written";
}

TEST_F(Motion, HeadingsGoTheShorterWay) {
  // From 3.0 rad across pi to -3.0 rad. Half-way is pi itself.
  const double half_rad = 3.0 / 2;
  const Trajectory known =
      trajectory(fmt::format("# mocap\n5 1 2 0.4 0 0 {0:.15f} {1:.15f}\n6 3 1 0.4 0 0 -{0:.15f} {1:.15f}\n",
                             std::sin(half_rad), std::cos(half_rad)));
  const auto pose = known.at(at_s(5.25));
  ASSERT_TRUE(pose);
  EXPECT_DOUBLE_EQ(pose->x_m, 1.5);
  EXPECT_DOUBLE_EQ(pose->y_m, 1.75);
  constexpr double kFileRounding_rad = 2e-9;  // a heading is kept to 1e-9 rad
  EXPECT_NEAR(pose->heading_rad, 3.0 + (std::numbers::pi - 3.0) / 2, kFileRounding_rad);
  EXPECT_NEAR(known.at(at_s(5.75))->heading_rad, -3.0 - (std::numbers::pi - 3.0) / 2, kFileRounding_rad);
  EXPECT_FALSE(known.at(at_s(6.1)));
}

TEST_F(Motion, WrongTrajectoriesAreRefused) {
  EXPECT_THAT(refusal_of_trajectory("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"), HasSubstr("times must rise"));
  EXPECT_THAT(refusal_of_trajectory("1 0 0 0 0 0 0 1\n2 nan 0 0 0 0 0 1\n"), HasSubstr("not finite"));
  EXPECT_THAT(refusal_of_trajectory("1 0 0 0\n"), HasSubstr("mocap.tum:1: has 4 numbers, must have 8"));
  EXPECT_THAT(refusal_of_trajectory("# none\n"), HasSubstr("has 0 times"));
  EXPECT_THROW(Trajectory(folder_.path() / "none.tum"), config::FileError);
}

}  // namespace
}  // namespace twocone::importer

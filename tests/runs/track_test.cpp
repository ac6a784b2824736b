// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/track.h"

#include <gtest/gtest.h>

namespace twocone::runs {
namespace {

files::Robot robot() {
  files::Robot robot;
  robot.drive.wheel_radius_m = 0.05;
  robot.drive.wheel_separation_m = 0.3;
  return robot;
}

localisation::Fix fix_at(double x_m, double y_m, double heading_rad) {
  localisation::Fix fix;
  fix.verdict = localisation::FixVerdict::kOk;
  fix.position_m = Eigen::Vector2d(x_m, y_m);
  fix.heading_rad = heading_rad;
  fix.covariance = Eigen::Vector3d(1e-6, 1e-6, 1e-8).asDiagonal();
  return fix;
}

TEST(Track, OfThePaperIsTheFixWithTheOdometrysHeading) {
  Track track(Method::kPaper, robot());
  const auto row = track.follow({0.5, 0, 0, 1, 1}, {0.5, 9, 9, 0.25}, fix_at(1.5, -0.5, 0.7));
  ASSERT_TRUE(row);
  EXPECT_EQ(row->t_s, 0.5);
  EXPECT_EQ(row->x_m, 1.5);
  EXPECT_EQ(row->heading_rad, 0.25);
  EXPECT_FALSE(track.follow({0.6, 0, 0, 1, 1}, {0.6, 9, 9, 0.25}, {})) << "no fix";
  localisation::Fix two = fix_at(0, 1, 0);
  two.other_position_m = Eigen::Vector2d(0, -1);
  EXPECT_FALSE(track.follow({0.7, 0, 0, 1, 1}, {0.7, 9, 9, 0.25}, two)) << "nobody knows which";
}

// Catches a track that forgets the wheels where there is no fix.
TEST(Track, OfFullGoesOnByTheWheelsWithoutAFix) {
  Track track(Method::kFull, robot());
  EXPECT_FALSE(track.follow({0, 0, 0, 0, 0}, {0, 0, 0, 0}, {})) << "nothing known yet";
  ASSERT_TRUE(track.follow({0.1, 0, 0, 0, 0}, {0.1, 0, 0, 0}, fix_at(1.5, -0.5, 0.0)));
  const auto row = track.follow({0.6, 10, 10, 4, 4}, {0.6, 0, 0, 0}, {});
  ASSERT_TRUE(row);
  // 4 rad of a wheel of 0.05 m, straight on.
  EXPECT_NEAR(row->x_m, 1.7, 2e-3);
  EXPECT_NEAR(row->y_m, -0.5, 1e-6);
}

TEST(Track, WithoutWheelsIsTheFixAlone) {
  const auto row = pose_of(0.7, fix_at(1.5, -0.5, 0.3));
  ASSERT_TRUE(row);
  EXPECT_EQ(row->t_s, 0.7);
  EXPECT_EQ(row->y_m, -0.5);
  EXPECT_EQ(row->heading_rad, 0.3);
  localisation::Fix no_heading = fix_at(1.5, -0.5, 0.3);
  no_heading.heading_rad.reset();
  EXPECT_FALSE(pose_of(0.7, no_heading)) << "no heading is made up";
  localisation::Fix ambiguous = fix_at(1.5, -0.5, 0.3);
  ambiguous.other_position_m = {0.1, 0.2};
  EXPECT_FALSE(pose_of(0.7, ambiguous));
  EXPECT_FALSE(pose_of(0.7, {}));
}

}  // namespace
}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/track.h"
#include "apps/runlog/answer_rows.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <Eigen/Dense>

#include <gtest/gtest.h>

namespace twocone::estimation {
namespace {

using localisation::FixUse;

config::Robot robot() {
  config::Robot robot;
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

/// A fix at another place, with degrees of freedom of its own.
localisation::Fix carried_fix() {
  localisation::Fix fix = fix_at(1, 0.5, 0);
  fix.degrees_of_freedom = 3;
  return fix;
}

runlog::TrackRow follow(Track& track, std::uint64_t frame, const runlog::DriveRow& drive,
                        const runlog::PoseRow& odometry, const localisation::Fix& fix) {
  return runlog::to_row(frame, odometry.t_s, fix,
                        track.follow(drive.t_s, drive.left_rad, drive.right_rad, odometry.heading_rad, fix));
}

runlog::TrackRow track_row(std::uint64_t frame, double t_s, const localisation::Fix& fix) {
  return runlog::to_row(frame, t_s, fix, track_without_wheels(fix));
}

TEST(Track, OfThePaperIsTheFixWithTheOdometrysHeading) {
  Track track(Method::kPaper, robot(), config::Map{});
  const runlog::TrackRow row = follow(track, 7, {0.5, 0, 0, 1, 1}, {0.5, 9, 9, 0.25}, fix_at(1.5, -0.5, 0.7));
  EXPECT_EQ(row.frame, 7U);
  EXPECT_EQ(row.t_s, 0.5);
  EXPECT_EQ(row.x_m, 1.5);
  EXPECT_EQ(row.heading_rad, 0.25);
  EXPECT_EQ(row.state, "") << "there is no filter";
  EXPECT_EQ(row.use, "taken");
  EXPECT_FALSE(row.var_x_m2);
  const runlog::TrackRow none = follow(track, 8, {0.6, 0, 0, 1, 1}, {0.6, 9, 9, 0.25}, {});
  EXPECT_FALSE(runlog::pose_of(none));
  EXPECT_EQ(none.fix, "too_few");
  EXPECT_EQ(none.use, "no_fix");
  localisation::Fix two = fix_at(0, 1, 0);
  two.other_position_m = Eigen::Vector2d(0, -1);
  const runlog::TrackRow undecided = follow(track, 9, {0.7, 0, 0, 1, 1}, {0.7, 9, 9, 0.25}, two);
  EXPECT_FALSE(runlog::pose_of(undecided)) << "it is unknown which is right";
  EXPECT_EQ(undecided.use, "undecided");
}

// Catches a track that ignores the wheels where there is no fix.
TEST(Track, OfOutlineContinuesWithTheWheelsWithoutAFix) {
  Track track(Method::kOutline, robot(), config::Map{});
  const runlog::TrackRow nothing = follow(track, 0, {0, 0, 0, 0, 0}, {0, 0, 0, 0}, {});
  EXPECT_FALSE(runlog::pose_of(nothing)) << "no pose is known yet";
  EXPECT_EQ(nothing.state, "lost");
  const runlog::TrackRow first = follow(track, 1, {0.1, 0, 0, 0, 0}, {0.1, 0, 0, 0}, fix_at(1.5, -0.5, 0.0));
  EXPECT_EQ(first.use, "started");
  EXPECT_EQ(first.state, "tracking");
  EXPECT_EQ(first.var_heading_rad2, 1e-8);
  const runlog::TrackRow row = follow(track, 2, {0.6, 10, 10, 4, 4}, {0.6, 0, 0, 0}, {});
  // 4 rad of a wheel of 0.05 m, straight ahead.
  ASSERT_TRUE(runlog::pose_of(row));
  EXPECT_NEAR(*row.x_m, 1.7, 2e-3);
  EXPECT_NEAR(*row.y_m, -0.5, 1e-6);
  EXPECT_GT(*row.var_x_m2, 1e-6);
  EXPECT_EQ(row.use, "no_fix");
}

// Catches a track that accepts a fix outside the robot file's walls, however small its sigma is.
TEST(Track, AFixOutsideTheBoundsIsNotFollowed) {
  Track track(Method::kOutline, robot(), config::Map{});
  ASSERT_TRUE(runlog::pose_of(follow(track, 0, {0, 0, 0, 0, 0}, {0, 0, 0, 0}, fix_at(1.5, -0.5, 0.0))));
  localisation::Fix outside = fix_at(4, -0.5, 0.0);
  outside.verdict = localisation::FixVerdict::kOutOfBounds;
  for (int i = 1; i <= 5; ++i) {
    const runlog::TrackRow row = follow(track, std::uint64_t(i), {0.1 * i, 0, 0, 0, 0}, {0.1 * i, 0, 0, 0}, outside);
    EXPECT_EQ(row.use, "out_of_bounds");
    EXPECT_EQ(row.fix, "out_of_bounds");
    EXPECT_EQ(row.state, "tracking");
    EXPECT_NEAR(*row.x_m, 1.5, 1e-9);
  }
  EXPECT_FALSE(runlog::pose_of(track_row(7, 0.7, outside))) << "nor without a filter";
}

// ---- the floor plan

config::Robot robot_with_plan(const Pose2& start) {
  config::Robot with = robot();
  with.start = start;
  with.estimator.plan = true;
  return with;
}

/// A room of 4 m by 3 m with a chest in it.
config::Map room() {
  config::Map map;
  map.bounds = {-2, 2, -1.5, 1.5};
  map.obstacles.emplace_back(config::Polygon{{-2, 1}, {-1, 1}, {-1, 1.5}, {-2, 1.5}});
  return map;
}

/// Returns what a scan shows of the room from a pose: the nearest edge in the direction of each beam.
std::vector<vision::Beam> scan_of_room(const localisation::Pose& pose) {
  const localisation::FloorPlan plan = config::to_floor_plan(room());
  std::vector<vision::Beam> beams(360);
  for (std::size_t k = 0; k < beams.size(); ++k) {
    const double world_rad = pose.heading_rad + vision::beam_bearing_rad(k, beams.size());
    const Eigen::Vector2d along(std::cos(world_rad), std::sin(world_rad));
    double nearest_m = 100;
    for (const auto& edge : plan.edges) {
      Eigen::Matrix2d basis;
      basis << along, edge.from_m - edge.to_m;
      const Eigen::Vector2d met = basis.inverse() * (edge.from_m - Eigen::Vector2d(pose.x_m, pose.y_m));
      if (met.allFinite() && met.x() > 0 && met.y() >= 0 && met.y() <= 1) nearest_m = std::min(nearest_m, met.x());
    }
    beams[k].state = vision::BeamState::kOccupied;
    beams[k].range_m = nearest_m;
    beams[k].sigma_m = 0.01;
  }
  return beams;
}

TEST(Track, AFloorPlanPlacesARobotWithoutLandmarks) {
  // The robot is not where its file says, by as much as may be.
  Track track(Method::kOutline, robot_with_plan({0.2, -0.3, 0.1}), room());
  const localisation::Pose truth{0.4, -0.1, 0.25};
  const TrackAnswer first = track.follow(0, 0, 0, 0, {}, scan_of_room(truth));
  EXPECT_EQ(first.plan_use, FixUse::kStarted);
  EXPECT_EQ(first.use, FixUse::kNoFix);
  ASSERT_TRUE(first.position_m);
  EXPECT_NEAR((*first.position_m - Eigen::Vector2d(truth.x_m, truth.y_m)).norm(), 0, 1e-3);
  EXPECT_NEAR(*first.heading_rad, truth.heading_rad, 1e-3);
  // It goes 0.2 m on.
  const localisation::Pose then{0.4 + 0.2 * std::cos(0.25), -0.1 + 0.2 * std::sin(0.25), 0.25};
  const TrackAnswer second = track.follow(1, 4, 4, 0, {}, scan_of_room(then));
  EXPECT_EQ(second.plan_use, FixUse::kTaken);
  EXPECT_NEAR((*second.position_m - Eigen::Vector2d(then.x_m, then.y_m)).norm(), 0, 2e-3);
}

// Catches a plan whose errors average away over frames: the walls are where they are in all of them.
TEST(Track, APlansErrorsDoNotAverageAway) {
  Track track(Method::kOutline, robot_with_plan({0, 0, 0}), room());
  const auto scan = scan_of_room({0, 0, 0});
  const double first_m2 = (*track.follow(0, 0, 0, 0, {}, scan).covariance)(0, 0);
  double last_m2 = 0;
  for (int i = 1; i < 100; ++i) last_m2 = (*track.follow(0.1 * i, 0, 0, 0, {}, scan).covariance)(0, 0);
  EXPECT_NEAR(last_m2, first_m2, 0.01 * first_m2);
}

TEST(Track, APlanYieldsToLandmarks) {
  Track track(Method::kOutline, robot_with_plan({0, 0, 0}), room());
  ASSERT_EQ(track.follow(0, 0, 0, 0, fix_at(0, 0, 0), scan_of_room({0, 0, 0})).plan_use, FixUse::kTaken);
  // A scan that shows the robot 0.15 m beside the landmarks' pose is matched with the wrong walls.
  const TrackAnswer beside = track.follow(0.1, 0, 0, 0, fix_at(0, 0, 0), scan_of_room({0.15, 0, 0}));
  EXPECT_EQ(beside.plan_use, FixUse::kUnexpected);
  EXPECT_NEAR(beside.position_m->x(), 0, 1e-3);
  // A carried robot is found by its landmarks, although the plan agrees with the place before.
  TrackAnswer carried;
  for (int i = 2; i < 6; ++i) carried = track.follow(0.1 * i, 0, 0, 0, carried_fix(), scan_of_room({0, 0, 0}));
  EXPECT_NEAR(carried.position_m->x(), 1, 1e-3);
  EXPECT_EQ(Track(Method::kOutline, robot(), room()).follow(0, 0, 0, 0, {}, scan_of_room({})).plan_use, std::nullopt);
}

TEST(Track, WithoutWheelsIsTheFixAlone) {
  const runlog::TrackRow row = track_row(7, 0.7, fix_at(1.5, -0.5, 0.3));
  EXPECT_EQ(row.t_s, 0.7);
  EXPECT_EQ(row.y_m, -0.5);
  EXPECT_EQ(row.heading_rad, 0.3);
  localisation::Fix no_heading = fix_at(1.5, -0.5, 0.3);
  no_heading.heading_rad.reset();
  EXPECT_FALSE(runlog::pose_of(track_row(7, 0.7, no_heading))) << "no heading is invented";
  localisation::Fix ambiguous = fix_at(1.5, -0.5, 0.3);
  ambiguous.other_position_m = {0.1, 0.2};
  EXPECT_FALSE(runlog::pose_of(track_row(7, 0.7, ambiguous)));
  localisation::Fix weak = fix_at(1.5, -0.5, 0.3);
  weak.verdict = localisation::FixVerdict::kWeak;
  EXPECT_FALSE(runlog::pose_of(track_row(7, 0.7, weak))) << "anywhere along its unseen direction";
  EXPECT_FALSE(runlog::pose_of(track_row(7, 0.7, {})));
}

// ---- wheels and odometry

using namespace std::chrono_literals;

Timestamp at(std::chrono::nanoseconds time) { return {ClockKind::kSteady, time}; }

TEST(WheelHistory, InterpolatesBetweenTwoReadings) {
  estimation::WheelHistory history;
  history.add({at(1000ms), 1, -1});
  history.add({at(1040ms), 2, -3});
  history.add({at(1080ms), 2, -3});
  const WheelAngles between = history.at(at(1010ms));
  EXPECT_EQ(between.time, at(1010ms));
  EXPECT_DOUBLE_EQ(between.left_rad, 1.25);
  EXPECT_DOUBLE_EQ(between.right_rad, -1.5);
  EXPECT_EQ(history.at(at(1060ms)).left_rad, 2);
  EXPECT_EQ(history.at(at(1040ms)).right_rad, -3);
}

// Readings of a simulation are from the step of the frame. The result equals the reading to the last bit.
TEST(WheelHistory, IsTheReadingItselfAtItsTimeAndBeyond) {
  estimation::WheelHistory history;
  history.add({at(10ms), 0.1, 0.2});
  EXPECT_EQ(history.at(at(10ms)).left_rad, 0.1);
  EXPECT_EQ(history.at(at(0ms)).left_rad, 0.1) << "there is no earlier reading";
  history.add({at(20ms), 0.3, 0.4});
  EXPECT_EQ(history.at(at(20ms)).left_rad, 0.3);
  EXPECT_EQ(history.at(at(25ms)).right_rad, 0.4) << "there is no later reading, and no extrapolation";
}

TEST(WheelHistory, ForgetsWhatNoFrameCanBeOf) {
  estimation::WheelHistory history;
  for (int i = 0; i <= 600; ++i) history.add({at(i * 100ms), double(i), 0});
  EXPECT_DOUBLE_EQ(history.at(at(56s)).left_rad, 560);
  EXPECT_GE(history.at(at(0s)).left_rad, 549);
}

TEST(WheelHistory, RefusesATimeOfAnotherClock) {
  estimation::WheelHistory history;
  history.add({at(10ms), 0.1, 0.2});
  EXPECT_THROW((void)history.at({ClockKind::kSimulated, 10ms}), std::invalid_argument);
}

TEST(BelievedPose, IsTheOdometryUntilAFixComes) {
  estimation::BelievedPose belief;
  belief.add_odometry(0, {1, 2, 0.3});
  EXPECT_EQ(belief.pose(), (localisation::Pose{1, 2, 0.3}));
}

TEST(BelievedPose, LateFixesCorrectByTheDifferenceAtTheirOwnFrame) {
  // The odometry has a constant error of (0.5, -0.2). Fixes arrive four frames late.
  estimation::BelievedPose belief;
  for (std::uint64_t frame = 0; frame < 60; ++frame) {
    const double x = 0.1 * double(frame);
    belief.add_odometry(frame, {x + 0.5, -0.2, 0.7});
    if (frame >= 4) belief.add_fix(frame - 4, {0.1 * double(frame - 4), 0});
  }
  // 56 corrections by a fifth each leave 0.8^56 of the error.
  const double left_m = 0.5 * std::pow(1 - estimation::BelievedPose::kShare, 56) * 1.01;
  EXPECT_NEAR(belief.pose().x_m, 5.9, left_m);
  EXPECT_NEAR(belief.pose().y_m, 0, left_m);
  EXPECT_EQ(belief.pose().heading_rad, 0.7);
}

TEST(BelievedPose, FramesWithoutAFixAreLeftBehind) {
  estimation::BelievedPose belief;
  for (std::uint64_t frame = 0; frame < 10; ++frame) belief.add_odometry(frame, {double(frame), 0, 0});
  belief.add_fix(7, {8, 0});
  EXPECT_DOUBLE_EQ(belief.pose().x_m, 9 + estimation::BelievedPose::kShare);
}

}  // namespace
}  // namespace twocone::estimation

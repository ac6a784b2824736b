// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/self_rig.h"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "tests/support/lab_robot.h"

namespace twocone::estimation {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::UnorderedElementsAre;
using testing_support::lab_robot;
using vision::MirrorVerdict;
using vision::NotFound;

config::Map lab_map() {
  config::Map map;
  map.bounds = {-3, 3, -2.5, 2.5};
  map.landmarks = {{"red", {0.8, 0.03, 0.03}, 1.3, 0.4, 0.15, 0.9}, {"green", {0.03, 0.8, 0.03}, -1.1, 1.2, 0.15, 0.9}};
  return map;
}

/// A finder's answer that agrees with lab_robot().
vision::SelfRig as_in_file() {
  vision::SelfRig found;
  for (vision::SelfView& view : found.views) {
    view.mirror.verdict = MirrorVerdict::kFound;
    view.circle = vision::RimMeasurement{{319.5, 239.5}, 236, 0.05, 0.05, 0.2, 0.9};
    view.mirror.rim = view.circle;
    view.centre_px = {319.5, 239.5};
    view.sigma_centre_px = 0.5;
    view.mirrored = {false, 9, NotFound::kNothing};
    view.landmarks = 6;
  }
  found.exchanged = {false, 20, NotFound::kNothing};
  found.relative_azimuth = {0.0, 0.005, NotFound::kNothing};
  found.azimuth = {0.0, 0.01, NotFound::kNothing};
  return found;
}

std::vector<std::string> keys_of(const SelfRigAnswer& answer) {
  std::vector<std::string> keys;
  for (const RigDifference& difference : answer.differences) keys.push_back(difference.key);
  return keys;
}

SelfRigAnswer compared(const config::Robot& robot, const vision::SelfRig& found) {
  return compare_with_file(robot, found, self_rig_problem(robot, lab_map()));
}

// Catches a start that always replaces the file, which calibration alone may improve by hundredths of a pixel.
TEST(SelfRig, AFileThatAgreesIsKept) {
  vision::SelfRig found = as_in_file();
  found.views[0].centre_px.x() += 1.3;
  found.relative_azimuth.rad = 0.02;
  const SelfRigAnswer answer = compared(lab_robot(), found);
  EXPECT_THAT(keys_of(answer), ElementsAre());
  EXPECT_EQ(answer.rig, lab_robot().rig);
  EXPECT_TRUE(changes_to(answer).empty());
}

TEST(SelfRig, NumbersThatTheImagesContradictAreReplacedWithTheirSigmas) {
  vision::SelfRig found = as_in_file();
  found.views[0].centre_px = {352.25, 201.5};
  found.views[1].circle->radius_px = 197.5;
  found.views[1].mirrored.value = true;
  found.relative_azimuth.rad = -0.75;
  found.azimuth.rad = 0.5;
  config::Robot robot = lab_robot();
  robot.rig.sigma = config::RigSigma{};  // exact by construction
  const SelfRigAnswer answer = compared(robot, found);
  EXPECT_THAT(keys_of(answer), UnorderedElementsAre("lower.centre_px", "upper.rim_radius_px", "upper.mirrored",
                                                    "lower.azimuth_rad", "upper.azimuth_rad"));
  EXPECT_EQ(answer.rig.lower.centre_px, (std::array{352.25, 201.5}));
  EXPECT_EQ(answer.rig.upper.rim_radius_px, 197.5);
  EXPECT_TRUE(answer.rig.upper.mirrored);
  EXPECT_DOUBLE_EQ(answer.rig.lower.azimuth_rad, 0.5);
  EXPECT_DOUBLE_EQ(answer.rig.upper.azimuth_rad, -0.25);
  // What is found from images is not exact, even where the file says that all is.
  EXPECT_EQ(answer.rig.sigma->centre_px, 0.5);
  EXPECT_EQ(answer.rig.sigma->azimuth_rad, 0.01);
  EXPECT_EQ(answer.rig.sigma->mirror_radius_m, 0);
  std::vector<std::string> changes;
  for (const config::KeyChange& change : changes_to(answer)) changes.push_back(to_string(change));
  EXPECT_THAT(changes, testing::Contains("rig.lower.centre_px=[352.25, 201.5]"));
  EXPECT_THAT(changes, testing::Contains("rig.upper.mirrored=true"));
  EXPECT_THAT(changes.back(), HasSubstr("centre_px: 0.5"));
}

// Catches one sigma for a tilt that was found and another that was only believed, and tilts that replace better ones.
TEST(SelfRig, BothTiltsAreReplacedIfOneIsContradicted) {
  vision::SelfRig found = as_in_file();
  for (vision::SelfView& view : found.views) {
    view.tilt_rad = Eigen::Vector2d(0.004, -0.003);
    view.sigma_tilt_rad = 0.003;
  }
  EXPECT_THAT(keys_of(compared(lab_robot(), found)), ElementsAre());
  found.views[1].tilt_rad = Eigen::Vector2d(0.03, 0.01);
  found.views[1].sigma_tilt_rad = 0.004;
  const SelfRigAnswer answer = compared(lab_robot(), found);
  EXPECT_THAT(keys_of(answer), ElementsAre("lower.tilt_rad", "upper.tilt_rad"));
  EXPECT_THAT(answer.rig.lower.tilt_rad, ElementsAre(0.004, -0.003));
  EXPECT_THAT(answer.rig.upper.tilt_rad, ElementsAre(0.03, 0.01));
  ASSERT_TRUE(answer.rig.sigma);
  EXPECT_DOUBLE_EQ(answer.rig.sigma->tilt_rad, 0.004);
}

// Catches a rim that is stated as exactly as the images show it, although a lens that is not known has moved it there.
TEST(SelfRig, ALensThatIsNotKnownCountsInTheRimsSigmas) {
  vision::SelfRig found = as_in_file();
  found.views[1].circle->radius_px = 197.5;
  found.views[1].centre_px = {349.5, 199.5};  // (30, -40) px off the lens's axis
  config::Robot robot = lab_robot();
  robot.rig.sigma = config::RigSigma{.distortion = 0.03};
  const SelfRigAnswer answer = compared(robot, found);
  // v is three times the rim's radius.
  EXPECT_NEAR(answer.rig.sigma->rim_radius_px, std::hypot(0.05, 0.03 * 197.5 / 9), 1e-9);
  EXPECT_NEAR(answer.rig.sigma->centre_px, std::hypot(0.5, 3 * 0.03 * 50 / 9), 1e-9);
}

// Catches a centre whose sigma does not hold by how much a lens moves a circle that is not about its axis.
TEST(SelfRig, TheSigmaOfACentreIsWhatTheLensMovesACircleBy) {
  constexpr double kK1 = 0.03, kRadius_px = 236;
  const Eigen::Vector2d from_axis_px(12, -5);
  vision::SelfRig found = as_in_file();
  found.views[1].centre_px += from_axis_px;
  found.views[1].sigma_centre_px = 0;
  config::Robot robot = lab_robot();
  robot.rig.sigma = config::RigSigma{.distortion = kK1};
  const SelfRigAnswer answer = compared(robot, found);

  Eigen::MatrixXd equations(360, 3);
  Eigen::VectorXd squares(360);
  for (int degree = 0; degree < 360; ++degree) {
    const Eigen::Rotation2Dd turn(degree * std::numbers::pi / 180);
    const Eigen::Vector2d straight_px = from_axis_px + kRadius_px * (turn * Eigen::Vector2d::UnitX());
    const Eigen::Vector2d bent_px = straight_px * (1 + kK1 * straight_px.squaredNorm() / std::pow(3 * kRadius_px, 2));
    equations.row(degree) << 2 * bent_px.x(), 2 * bent_px.y(), 1;
    squares[degree] = bent_px.squaredNorm();
  }
  const Eigen::Vector3d circle = equations.colPivHouseholderQr().solve(squares);
  const double moved_px = (circle.head<2>() - from_axis_px).norm();
  ASSERT_TRUE(answer.rig.sigma);
  EXPECT_NEAR(answer.rig.sigma->centre_px, moved_px, 0.02 * moved_px);
}

// Catches an upper azimuth that does not follow a lower one which only the file knows.
TEST(SelfRig, WithoutMotionTheLowerAzimuthIsTheFiles) {
  vision::SelfRig found = as_in_file();
  found.azimuth = {{}, 0, NotFound::kNoMotion};
  found.relative_azimuth.rad = 1.25;
  config::Robot robot = lab_robot();
  robot.rig.lower.azimuth_rad = 0.4;
  const SelfRigAnswer answer = compared(robot, found);
  EXPECT_THAT(keys_of(answer), ElementsAre("upper.azimuth_rad"));
  EXPECT_DOUBLE_EQ(answer.rig.upper.azimuth_rad, 1.65);
}

// Catches the wrong camera's numbers for a mirror.
TEST(SelfRig, OfExchangedCamerasEachMirrorGetsItsOwnCircle) {
  vision::SelfRig found = as_in_file();
  found.exchanged.value = true;
  found.views[0].centre_px = {300, 230};
  found.views[1].mirrored.value = true;
  const SelfRigAnswer answer = compared(lab_robot(), found);
  EXPECT_EQ(answer.rig.upper.centre_px, (std::array{300.0, 230.0}));
  EXPECT_TRUE(answer.rig.lower.mirrored);
  EXPECT_FALSE(answer.rig.upper.mirrored);
}

TEST(SelfRig, KeysThatAreLeftToTheImagesAreTakenFromThem) {
  config::Robot robot = lab_robot();
  robot.rig.missing = {"lower.centre_px", "upper.azimuth_rad"};
  EXPECT_FALSE(self_rig_problem(robot, lab_map()).has_believed_circles);
  const SelfRigAnswer answer = compared(robot, as_in_file());
  EXPECT_THAT(keys_of(answer), UnorderedElementsAre("lower.centre_px", "upper.azimuth_rad"));
  EXPECT_TRUE(answer.rig.missing.empty());
  EXPECT_EQ(answer.differences.front().in_file, "");
}

TEST(SelfRig, EachCauseNamesWhatToChange) {
  const auto said = [](const auto& change) {
    vision::SelfRig found = as_in_file();
    change(found);
    return what_to_change(found);
  };
  const auto verdict = [&](MirrorVerdict why) {
    return said([why](vision::SelfRig& found) {
      found.views[1].mirror.verdict = why;
      found.views[1].circle.reset();
    });
  };
  EXPECT_THAT(verdict(MirrorVerdict::kDark), HasSubstr("camera upper are dark: take off the lens cap"));
  EXPECT_THAT(verdict(MirrorVerdict::kEven), HasSubstr("camera upper show nothing"));
  EXPECT_THAT(verdict(MirrorVerdict::kNoMirror), HasSubstr("something else than a mirror"));
  EXPECT_THAT(said([](vision::SelfRig& found) { found.shows_one_mirror = true; }), HasSubstr("the same mirror"));
  EXPECT_THAT(said([](vision::SelfRig& found) {
                found.views[0].landmarks = 1;
                found.views[0].mirrored = {{}, 0, NotFound::kNoLandmarks};
              }),
              HasSubstr("camera lower sees the colours of 1 of"));
  EXPECT_THAT(said([](vision::SelfRig& found) {
                found.views[1].mirrored = {{}, 0, NotFound::kNotTheMap};
              }),
              HasSubstr("do not stand as the map says"));
  EXPECT_THAT(said([](vision::SelfRig& found) {
                found.views[1].mirror.verdict = MirrorVerdict::kNoCircle;
                found.views[1].mirrored = {{}, 0, NotFound::kNotTheMap};
              }),
              HasSubstr("something else than a mirror"));
  EXPECT_THAT(said([](vision::SelfRig& found) {
                found.views[1].mirrored = {{}, 0, NotFound::kUndecided};
              }),
              HasSubstr("whether they are mirrored"));
}

TEST(SelfRig, LinesFollowTheOrderOfTheSearch) {
  vision::SelfRig found = as_in_file();
  found.exchanged.value = true;
  found.azimuth = {{}, 0, NotFound::kNoMotion};
  const auto lines = lines_of(found);
  ASSERT_EQ(lines.size(), 7U);
  EXPECT_THAT(lines[0], HasSubstr("camera lower: rim (319.5, 239.5)"));
  EXPECT_THAT(lines[2], HasSubstr("exchanged: camera lower shows the upper mirror"));
  EXPECT_THAT(lines[4], HasSubstr("camera upper: the image is not mirrored"));
  EXPECT_THAT(lines[6], HasSubstr("not found (no_motion)"));
}

}  // namespace
}  // namespace twocone::estimation

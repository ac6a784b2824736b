// SPDX-License-Identifier: Apache-2.0
// Localisation and mapping at the same time, in images whose pixels are exactly known.
#include "apps/estimation/mapping.h"

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "apps/estimation/image_as_mat.h"
#include "localisation/odometry.h"
#include "tests/support/lab_robot.h"
#include "tests/support/synthetic_bands.h"
#include "tests/support/synthetic_lab.h"
#include "vision/ranging.h"

namespace twocone::estimation {
namespace {

using testing_support::SyntheticLandmark;
using testing_support::SyntheticRig;
using testing_support::SyntheticScene;

config::Robot mapping_robot() {
  config::Robot robot = testing_support::lab_robot("memory");
  robot.start = Pose2{0.1, -0.8, 0.2};
  return robot;
}

config::Map mapping_room() {
  config::Map map;
  map.file = "room.map.yaml";
  map.bounds = {-4, 4, -4, 4};
  return map;
}

struct Driven {
  std::vector<MappedFrame> frames;
  std::vector<Pose2> poses;
};

/// Returns a grey post, a metre from the robot, that hides half of a landmark.
SyntheticLandmark post_before(const SyntheticLandmark& landmark, const Pose2& pose) {
  constexpr double kRadius_m = 0.1;
  const Eigen::Vector2d eye_m(pose.x_m, pose.y_m);
  const Eigen::Vector2d towards = (landmark.centre_m - eye_m).normalized();
  const Eigen::Vector2d at_m = eye_m + towards + kRadius_m * Eigen::Vector2d(-towards.y(), towards.x());
  return {at_m, kRadius_m, 1.5, {0.3, 0.3, 0.3}};
}

/// Drives on a circle, whose wheels lose a percent of their way, and maps. Somebody in orange walks through the room.
/// In the first `half_hidden` frames, a post hides half of the first landmark.
Driven drive(Mapping& mapping, int frames,
             const std::vector<SyntheticLandmark>& landmarks = testing_support::six_landmarks(), int half_hidden = 0) {
  constexpr double kFrame_s = 0.2;
  constexpr double kSlip = 0.99;
  const SyntheticRig lab(vision::lab_rig());
  std::mt19937_64 random(3);
  Driven driven;
  Pose2 pose = *mapping_robot().start;
  double left_rad = 0;
  double right_rad = 0;
  for (int i = 0; i < frames; ++i) {
    if (i > 0) {
      left_rad += 1.0;
      right_rad += 1.6;
      pose = localisation::drive_arc(pose, 0.05 * 1.0 * kSlip, 0.05 * 1.6 * kSlip, 0.30);
    }
    std::vector<SyntheticLandmark> all = landmarks;
    if (i >= 8 && i < 18) {
      all.push_back(testing_support::landmark(-2.2 + 0.45 * (i - 8), 0.9, {0.6, 0.31, 0.02}, 0.2));
    }
    if (i < half_hidden) all.push_back(post_before(landmarks.front(), pose));
    const SyntheticScene scene{testing_support::seen_from(all, {pose.x_m, pose.y_m}, pose.heading_rad), {}, {}};
    const auto pair = lab.take(scene, {.noise_grey_levels = 1.5}, random);
    auto answer = mapping.answer(as_image(pair.lower), as_image(pair.upper), {}, i * kFrame_s, left_rad, right_rad);
    EXPECT_TRUE(answer);
    driven.frames.push_back(*answer);
    driven.poses.push_back(pose);
  }
  return driven;
}

// Catches a landmark that is found twice, a person who becomes one, and a track or map whose sigma does not hold the
// truth.
TEST(Mapping, FindsLandmarksAndThePoseAtTheSameTime) {
  Mapping mapping(mapping_robot(), mapping_room());
  const Driven driven = drive(mapping, 70);
  const std::vector<MappedLandmark> found = mapping.landmarks();
  std::vector<std::string> names;
  for (const MappedLandmark& l : found) {
    names.push_back(l.name);
    const auto& truth = testing_support::six_landmarks();
    const auto is = std::ranges::min_element(
        truth, {}, [&](const SyntheticLandmark& t) { return (t.centre_m - vision::place_m(l.landmark)).norm(); });
    const Eigen::Vector2d off_m = vision::place_m(l.landmark) - is->centre_m;
    EXPECT_LT(off_m.norm(), 0.015) << l.name;
    EXPECT_LT(off_m.dot(l.place_m2.llt().solve(off_m)), 13.8) << l.name;  // chi-squared, once in a thousand
    EXPECT_NEAR(l.landmark.top_m, is->top_m, 0.004) << l.name;
    EXPECT_GT(l.sightings, 40U) << l.name;
  }
  EXPECT_THAT(names, testing::UnorderedElementsAre("red.1", "green.1", "blue.1", "cyan.1", "magenta.1", "yellow.1"));
  double squares = 0;
  constexpr int kLast = 30;
  for (std::size_t i = driven.frames.size() - kLast; i < driven.frames.size(); ++i) {
    const TrackAnswer& track = driven.frames[i].track;
    const Pose2& is = driven.poses[i];
    Eigen::Vector3d off;
    off << track.position_m->x() - is.x_m, track.position_m->y() - is.y_m,
        localisation::wrap_angle_rad(*track.heading_rad - is.heading_rad);
    EXPECT_LT(off.head<2>().norm(), 0.006) << i;
    squares += off.dot(track.covariance->llt().solve(off)) / kLast;
  }
  EXPECT_LT(squares, 3 * 3) << "3 is expected; the errors of neighbouring frames are one";
}

// Catches a landmark that stays where its visible half seemed to be.
TEST(Mapping, FindsAgainWhatWasHalfHidden) {
  Mapping mapping(mapping_robot(), mapping_room());
  constexpr int kHalfHidden = 25;
  (void)drive(mapping, kHalfHidden, testing_support::six_landmarks(), kHalfHidden);
  const SyntheticLandmark truth = testing_support::six_landmarks().front();
  const auto error_m = [&](const Mapping& by) {
    double least_m = 1;
    for (const MappedLandmark& l : by.landmarks()) {
      least_m = std::min(least_m, (vision::place_m(l.landmark) - truth.centre_m).norm());
    }
    return least_m;
  };
  EXPECT_GT(error_m(mapping), 0.03) << "the post does not hide it";
  Mapping whole(mapping_robot(), mapping_room());
  (void)drive(whole, 110, testing_support::six_landmarks(), kHalfHidden);
  EXPECT_LT(error_m(whole), 0.015);
  EXPECT_EQ(whole.landmarks().size(), 6U);
}

// Catches coloured things on the map of a room whose landmarks have bands.
TEST(Mapping, GoesByBandsAmongColours) {
  std::vector<Landmark> banded;
  std::vector<SyntheticLandmark> all = testing_support::six_landmarks();
  for (const auto& [number, place_m] :
       {std::pair(5, Eigen::Vector2d(1.9, -0.6)), {17, {0.3, 2.1}}, {30, {-1.9, 0.7}}, {64, {-0.2, -2.9}}}) {
    banded.push_back(testing_support::banded(number, place_m));
    // The pipe's parts are to hide each other as seen from the robot, which stays within half a metre of (0.2, -0.5).
    const auto pipe = testing_support::pipe_of(banded.back());
    all.insert(all.end(), pipe.begin(), pipe.end());
  }
  Mapping mapping(mapping_robot(), mapping_room());
  (void)drive(mapping, 40, all);
  const std::vector<MappedLandmark> found = mapping.landmarks();
  EXPECT_GE(found.size(), 3U);
  for (const MappedLandmark& l : found) {
    ASSERT_TRUE(l.landmark.bands) << l.name;
    const auto is =
        std::ranges::find_if(banded, [&](const Landmark& b) { return b.bands->number == l.landmark.bands->number; });
    ASSERT_NE(is, banded.end()) << l.name;
    EXPECT_EQ(l.name, is->name);
    const Eigen::Vector2d off_m = vision::place_m(l.landmark) - vision::place_m(*is);
    EXPECT_LT(off_m.norm(), 0.04) << l.name;
    EXPECT_LT(off_m.dot(l.place_m2.llt().solve(off_m)), 13.8) << l.name;
    EXPECT_NEAR(l.landmark.top_m, is->top_m, 0.004) << l.name;
  }
}

TEST(Mapping, GoesByTheWheelsWhereNothingIsSeen) {
  Mapping mapping(mapping_robot(), mapping_room());
  const Image dark = as_image(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(0)));
  for (int i = 0; i < 3; ++i) {
    const auto answer = mapping.answer(dark, dark, {}, i, 2.0 * i, 2.0 * i);
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->track.use, localisation::FixUse::kNoFix);
    const double way_m = 0.05 * 2 * i;
    EXPECT_NEAR(answer->track.position_m->x(), 0.1 + way_m * std::cos(0.2), 1e-9);
    EXPECT_NEAR(answer->track.position_m->y(), -0.8 + way_m * std::sin(0.2), 1e-9);
  }
  EXPECT_TRUE(mapping.landmarks().empty());
  const Image small = as_image(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(0)));
  const auto refused = mapping.answer(small, dark, {}, 4, 8, 8);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, testing::HasSubstr("the lower image has 64 x 48 pixels"));
}

}  // namespace
}  // namespace twocone::estimation

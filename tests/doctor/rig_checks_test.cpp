// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "apps/doctor/checks/checks.h"
#include "apps/runlog/storage/image_file.h"
#include "tests/doctor/bench_devices.h"
#include "tests/support/lab_robot.h"
#include "tests/support/mirror_in_room.h"
#include "tests/support/synthetic_lab.h"
#include "tests/support/temporary_folder.h"

namespace twocone::doctor {
namespace {

using testing::HasSubstr;
using testing_support::lab_robot;
using testing_support::seen_from;
using testing_support::six_landmarks;
using testing_support::surround;
using testing_support::SyntheticRig;
using testing_support::SyntheticScene;
using testing_support::targets_of;
using testing_support::TemporaryFolder;

struct Pair {
  cv::Mat lower, upper;
};

/// The images of a robot as its file says, in the synthetic lab.
const Pair& good_pair() {
  static const Pair pair = [] {
    std::mt19937_64 random(41);
    const SyntheticRig rig(vision::lab_rig(), {.level = 0.35, .swing = 0.2, .cells = 9, .contrast = 0.3});
    SyntheticScene scene;
    scene.landmarks = seen_from(six_landmarks(), {0.35, -0.15}, 0.8);
    auto taken = rig.take(scene, {}, random);
    surround(taken.lower, {319.5, 239.5}, 236, testing_support::Surroundings::kEvenGrey);
    surround(taken.upper, {319.5, 239.5}, 236, testing_support::Surroundings::kChequer);
    return Pair{taken.lower, taken.upper};
  }();
  return pair;
}

Report checked(const Pair& pair, const std::filesystem::path& images = {}, const config::Robot& robot = lab_robot()) {
  config::Map map;
  map.bounds = {-3, 3, -2.5, 2.5};
  map.landmarks = targets_of(six_landmarks());
  Report report;
  check_rig({robot, map, pair.lower, pair.upper, images}, report);
  return report;
}

cv::Mat over(const cv::Mat& image) {
  cv::Mat flipped;
  cv::flip(image, flipped, 1);
  return flipped;
}

TEST(DoctorRig, ARigInOrderIsOk) {
  const TemporaryFolder folder;
  const Report report = checked(good_pair(), folder.path() / "images");
  EXPECT_EQ(report.count(kOk), report.rows().size()) << table(report);
  for (const char* name : {"lower.png", "upper.png"}) {
    const auto image = runlog::read_rgb(folder.path() / "images" / name);
    ASSERT_TRUE(image) << image.error().message;
    ASSERT_EQ(image->size(), cv::Size(640, 480));
    // The green circle lies on the rim, whose leftmost pixel is here.
    const auto pixel = image->at<cv::Vec3b>(240, 83);
    EXPECT_GT(pixel[1], pixel[0]) << name;
  }
}

// Each of these had no row that named it (and wrong verdicts of landmarks).
TEST(DoctorRig, NamesExchangedMirroredAndTurnedCameras) {
  const Pair& good = good_pair();
  const Row exchanged = row_of(checked({good.upper, good.lower}), "rig", "cameras");
  EXPECT_EQ(exchanged.verdict, kFailed);
  EXPECT_THAT(exchanged.advice, HasSubstr("exchange the entries"));

  const Report one = checked({good.lower, over(good.upper)});
  EXPECT_EQ(row_of(one, "rig", "mirrored lower").verdict, kOk);
  EXPECT_EQ(row_of(one, "rig", "mirrored upper").verdict, kFailed);
  EXPECT_THAT(row_of(one, "rig", "mirrored upper").advice, HasSubstr("rig: upper: {mirrored: true}"));

  const Report both = checked({over(good.lower), over(good.upper)});
  EXPECT_EQ(row_of(both, "rig", "mirrored lower").verdict, kFailed);
  EXPECT_EQ(row_of(both, "rig", "mirrored upper").verdict, kFailed);

  cv::Mat turned;
  cv::rotate(good.upper, turned, cv::ROTATE_180);
  const Row azimuth = row_of(checked({good.lower, turned}), "rig", "azimuth");
  EXPECT_EQ(azimuth.verdict, kFailed);
  EXPECT_THAT(azimuth.measured, HasSubstr("rig: says 0.0"));

  EXPECT_THAT(row_of(checked({good.lower, good.lower}), "rig", "cameras").measured, HasSubstr("the same mirror"));
}

TEST(DoctorRig, WithoutLandmarksItIsNotRun) {
  const Pair& good = good_pair();
  const Report report = checked({good.lower, cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(3))});
  EXPECT_EQ(row_of(report, "rig", "cameras").verdict, kNotRun);
  EXPECT_THAT(row_of(report, "rig", "cameras").advice, HasSubstr("lens cap"));
}

}  // namespace
}  // namespace twocone::doctor

// SPDX-License-Identifier: Apache-2.0
// Landmarks that no map lists, in images in which the coverage of every pixel is known.
#include "vision/landmark_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/synthetic_lab.h"
#include "vision/hue_labels.h"

namespace twocone::vision {
namespace {

using testing_support::landmark;
using testing_support::seen_from;
using testing_support::six_landmarks;
using testing_support::SyntheticCamera;
using testing_support::SyntheticLandmark;
using testing_support::SyntheticRig;
using testing_support::SyntheticScene;

const SyntheticRig& lab() {
  static const SyntheticRig rig(lab_rig());
  return rig;
}

std::vector<MirrorImage> images_of(const std::vector<SyntheticScene>& scenes) {
  std::mt19937_64 random(3);
  std::vector<MirrorImage> images;
  for (const SyntheticScene& scene : scenes) {
    const auto pair = lab().take(scene, {.noise_grey_levels = 1.5}, random);
    const auto add = [&](const cv::Mat& rgb, const MirrorView& view) {
      images.push_back({rgb, view.settings().centre_px, view.settings().rim_radius_px});
    };
    add(pair.lower, lab().rig.lower);
    add(pair.upper, lab().rig.upper);
  }
  return images;
}

std::vector<SyntheticScene> places(const std::vector<SyntheticLandmark>& landmarks) {
  std::vector<SyntheticScene> scenes;
  for (const auto& [x, y, heading] : {std::tuple{0.13, -0.21, 0.37}, {-0.61, 0.47, 2.11}, {0.83, 0.29, -1.73}}) {
    scenes.push_back({seen_from(landmarks, {x, y}, heading), {}, {}});
  }
  return scenes;
}

/// Returns the things that a frame shows, with the hues of `landmarks`, all distinct.
std::vector<RoughLandmark> look(const SyntheticScene& scene, const std::vector<Eigen::Vector3d>& colours) {
  std::mt19937_64 random(5);
  const auto pair = lab().take(scene, {.noise_grey_levels = 1.5}, random);
  return LandmarkSearch(lab_rig(), colours, kImage, kImage).look(pair.lower, pair.upper);
}

TEST(FindHues, GivesEachColourOnceInTheOrderOfHues) {
  const auto colours = find_hues(images_of(places(six_landmarks())));
  ASSERT_EQ(colours.size(), 6U);
  std::vector<double> hues_deg;
  for (const Eigen::Vector3d& c : colours) hues_deg.push_back(hue_rad({c.x(), c.y(), c.z()}) * 180 / std::numbers::pi);
  // Red, yellow, green, cyan, blue, magenta. Mixtures with a grey background do not change the hue.
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(std::remainder(hues_deg[i] - 60.0 * double(i), 360), 0, 2) << i;
  }
}

// Catches a landmark that is seen in a part of a drive only, and colours of noise.
TEST(FindHues, FindsWhatOneOfFiveImagesShowsAndNothingInAGreyRoom) {
  std::vector<SyntheticScene> scenes(4);
  EXPECT_TRUE(find_hues(images_of(scenes)).empty());
  scenes.push_back({{landmark(1.2, 0.4, {0.6, 0.02, 0.02})}, {}, {}});
  EXPECT_EQ(find_hues(images_of(scenes)).size(), 1U);
  EXPECT_TRUE(find_hues({}).empty());
  EXPECT_THROW((void)find_hues({{cv::Mat(8, 8, CV_8U), {4, 4}, 3}}), std::invalid_argument);
}

TEST(LandmarkSearch, GivesPlaceTopAndRadiusOfEachLandmark) {
  std::size_t found = 0;
  for (const SyntheticScene& scene : places(six_landmarks())) {
    std::vector<Eigen::Vector3d> colours;
    for (const SyntheticLandmark& l : scene.landmarks) colours.push_back(l.colour);
    for (const RoughLandmark& thing : look(scene, colours)) {
      const SyntheticLandmark& truth = scene.landmarks[thing.hue];
      const double range_m = truth.centre_m.norm();
      // Half a pixel of both views is a pixel of disparity, of v s / (range + d) = 708 * 0.3 / (range + 0.12) px.
      const double sigma_m = (range_m + 0.12) * (range_m + 0.12) / (708 * 0.3);
      EXPECT_NEAR(thing.range_m, range_m, 2 * sigma_m) << thing.hue;
      EXPECT_NEAR(std::remainder(thing.bearing_rad - std::atan2(truth.centre_m.y(), truth.centre_m.x()), 6.283185307),
                  0, 0.01)
          << thing.hue;
      EXPECT_NEAR(thing.top_m, truth.top_m, 0.03) << thing.hue;
      EXPECT_NEAR(thing.radius_m, truth.radius_m, 0.15 * truth.radius_m) << thing.hue;
      ++found;
    }
  }
  // The tops of the nearest are beyond the lower mirror's rim.
  EXPECT_GE(found, 14U);
}

// Catches views that are paired across two landmarks of one colour, and a landmark that takes the other's place.
TEST(LandmarkSearch, TellsTwoOfOneColourApart) {
  const Eigen::Vector3d red(0.6, 0.02, 0.02);
  const SyntheticScene scene{{landmark(1.9, 0.6, red, 0.1), landmark(1.7, 1.5, red, 0.1)}, {}, {}};
  const auto things = look(scene, {red});
  ASSERT_EQ(things.size(), 2U);
  for (const SyntheticLandmark& truth : scene.landmarks) {
    const bool is_found = std::ranges::any_of(things, [&](const RoughLandmark& thing) {
      const Eigen::Vector2d place_m =
          thing.range_m * Eigen::Vector2d(std::cos(thing.bearing_rad), std::sin(thing.bearing_rad));
      return (place_m - truth.centre_m).norm() < 0.06;
    });
    EXPECT_TRUE(is_found) << truth.centre_m.transpose();
  }
}

TEST(LandmarkSearch, TakesPixelsToTheFramesTime) {
  // While the body turns, the upper image is taken 40 ms later: the bearing there is off by 0.8 * 0.04 rad.
  const BodyTwist twist{.forward_mps = 0, .turn_radps = 0.8};
  const SyntheticScene now{{landmark(1.9, 0.6, {0.6, 0.02, 0.02}, 0.1)}, {}, {}};
  SyntheticScene later = now;
  later.landmarks[0].centre_m = place_after(now.landmarks[0].centre_m, twist, 0.04);
  std::mt19937_64 random(5);
  const auto pair = lab().take(now, {}, random);
  const auto upper = lab().take(later, {}, random).upper;
  const LandmarkSearch search(lab_rig(), {{0.6, 0.02, 0.02}}, kImage, kImage);
  const auto still = search.look(pair.lower, pair.upper);
  const auto moving = search.look(pair.lower, upper, FrameMotion{twist, 0.04});
  ASSERT_EQ(still.size(), 1U);
  ASSERT_EQ(moving.size(), 1U);
  EXPECT_LT((still[0].views[1].pixel_px - moving[0].views[1].pixel_px).norm(), 0.6);
}

TEST(LandmarkSearch, RefusesWrongImages) {
  EXPECT_THROW(LandmarkSearch(lab_rig(), {{1, 0, 0}}, {0, 480}, kImage), std::invalid_argument);
  EXPECT_THROW(LandmarkSearch(lab_rig(), {{1, 1, 1}}, kImage, kImage), std::invalid_argument);
  const LandmarkSearch search(lab_rig(), {{1, 0, 0}}, kImage, kImage);
  EXPECT_THROW((void)search.look(cv::Mat(kImage, CV_8U), cv::Mat(kImage, CV_8UC3)), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::vision

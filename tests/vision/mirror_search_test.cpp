// SPDX-License-Identifier: Apache-2.0
#include "vision/mirror_search.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/mirror_in_room.h"
#include "tests/support/synthetic_lab.h"

namespace twocone::vision {
namespace {

using namespace testing_support;

// The surroundings are mixed with the rim in coded values, which moves an edge by a quarter of a pixel, and the search
// before black is good to kRoughRimSigma_px.
constexpr double kRim_px = 1.0;
// Edges of six landmarks and of a chequer; noise of up to 4 grey levels.
constexpr double kTip_px = 2.0;

/// A mirror somewhere in the image, among surroundings.
struct Place {
  Eigen::Vector2d centre_px;
  double radius_px;
};

cv::Mat mirror_image(const Place& place, Surroundings surroundings, double noise, std::uint64_t seed,
                     bool has_mast = false) {
  std::mt19937_64 random(seed);
  MirrorViewSettings settings = lab_view(0.25);
  settings.centre_px = place.centre_px;
  settings.rim_radius_px = place.radius_px;
  settings.azimuth_rad = 0.37 * double(seed);
  const SyntheticView view(MirrorView(settings), kImage, {.level = 0.35, .swing = 0.2, .cells = 9, .contrast = 0.3});
  SyntheticScene scene;
  scene.landmarks = seen_from(six_landmarks(), {0.3, -0.2}, 0.9);
  if (has_mast) scene.strips.push_back({1.1, 0.12, 0.012, {0.05, 0.05, 0.05}});
  cv::Mat image = view.image(scene, {}, random);
  surround(image, place.centre_px, place.radius_px, surroundings);
  if (has_mast) {  // seen directly, it also covers the rim
    const double angle = 1.1 - settings.azimuth_rad;
    for (double r = 0.8 * place.radius_px; r < 1.3 * place.radius_px; r += 0.5) {
      for (double across = -14; across <= 14; across += 0.5) {
        const int column = static_cast<int>(place.centre_px.x() + r * std::cos(angle) - across * std::sin(angle));
        const int row = static_cast<int>(place.centre_px.y() + r * std::sin(angle) + across * std::cos(angle));
        if (column < 0 || row < 0 || column >= image.cols || row >= image.rows) continue;
        image.at<cv::Vec3b>(row, column) = {60, 60, 60};
      }
    }
  }
  add_noise(image, noise, random);
  return image;
}

void expect_found(const MirrorSearch& found, const Place& place, const char* what) {
  ASSERT_EQ(found.verdict, MirrorVerdict::kFound)
      << what << ": " << to_string(found.verdict) << ", upright share " << found.upright_share;
  EXPECT_NEAR((found.rim->centre_px - place.centre_px).norm(), 0, kRim_px) << what;
  EXPECT_NEAR(found.rim->radius_px, place.radius_px, kRim_px) << what;
  ASSERT_TRUE(found.tip) << what;
  EXPECT_NEAR((found.tip->centre_px - place.centre_px).norm(), 0, kTip_px) << what;
}

// Catches a search that needs an expectation, a certain contrast, or the whole rim in the image.
TEST(FindMirror, FindsTheRimWhereverItIs) {
  const Place places[]{{{319.5, 239.5}, 236}, {{281.3, 277.1}, 236}, {{357.2, 203.4}, 189},
                       {{340.6, 249.8}, 283}, {{171.3, 151.2}, 118}, {{300.1, 222.7}, 205.3}};
  std::uint64_t seed = 1;
  for (const Place& place : places) {
    for (int kind = 0; kind < kSurroundings; ++kind) {
      // A view costs a second here, so that each place has a third of the kinds; first_day_bench has many more.
      if ((std::uint64_t(kind) + seed / kSurroundings) % 3 != 0) {
        ++seed;
        continue;
      }
      SCOPED_TRACE(testing::Message() << "surroundings " << kind << ", radius " << place.radius_px << " px at "
                                      << place.centre_px.transpose());
      const double noise = double(seed % 3) * 2;
      expect_found(find_mirror(std::vector{mirror_image(place, Surroundings(kind), noise, seed)}), place, "alone");
      ++seed;
    }
  }
}

// Catches a rim that must be whole.
TEST(FindMirror, FindsTheRimBehindAMast) {
  for (int kind = 0; kind < kSurroundings; kind += 2) {
    const Place place{{311.4, 246.2}, 221.7};
    expect_found(find_mirror(std::vector{mirror_image(place, Surroundings(kind), 3, 7, true)}), place, "mast");
  }
}

// Catches an average of images that loses a rim whose surroundings turn from brighter to darker.
TEST(FindMirror, FindsTheRimThatLastsThroughADrive) {
  const Place place{{333.1, 228.4}, 231.6};
  std::vector<cv::Mat> images;
  for (int i = 0; i < 4; ++i) {
    images.push_back(mirror_image(place, i % 2 == 0 ? Surroundings::kSplit : Surroundings::kEvenGrey, 4, 20 + i));
  }
  expect_found(find_mirror(images), place, "four images");
}

// Catches the outer edge of a ring that is reported as the only rim.
TEST(FindMirror, NamesBothEdgesOfARing) {
  const Place place{{319.5, 239.5}, 201.2};
  const MirrorSearch found = find_mirror(std::vector{mirror_image(place, Surroundings::kBrightRing, 2, 3)});
  expect_found(found, place, "ring");
  ASSERT_EQ(found.others.size(), 1U);
  EXPECT_NEAR(found.others.front().radius_px, 1.09 * place.radius_px, kRim_px);
}

cv::Mat even(double level, double noise) {
  cv::Mat image(480, 640, CV_8UC3, cv::Scalar::all(level));
  std::mt19937_64 random(5);
  add_noise(image, noise, random);
  return image;
}

/// Paints a random rectangle, as furniture and walls would be in an image of a room.
cv::Mat of_rectangles(std::uint64_t seed, int count) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  cv::Mat image = even(120, 0);
  for (int i = 0; i < count; ++i) {
    const int x = static_cast<int>(600 * uniform(random));
    const int y = static_cast<int>(440 * uniform(random));
    const cv::Rect rectangle =
        cv::Rect(x, y, 10 + static_cast<int>(200 * uniform(random)), 10 + static_cast<int>(150 * uniform(random))) &
        cv::Rect(0, 0, 640, 480);
    image(rectangle).setTo(cv::Scalar(255 * uniform(random), 255 * uniform(random), 255 * uniform(random)));
  }
  add_noise(image, 3, random);
  return image;
}

/// A plate: a circle with something even, or something else than a cone's image, inside.
cv::Mat plate(const std::function<double(double, double)>& grey) {
  cv::Mat image = even(60, 0);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      if (std::hypot(column - 300, row - 250) > 190) continue;
      image.at<cv::Vec3b>(row, column) = cv::Vec3b::all(static_cast<std::uint8_t>(grey(column - 300, row - 250)));
    }
  }
  return image;
}

// Each is an image in which a circle would be a wrong answer. Catches thresholds that let one pass.
TEST(FindMirror, SaysWhyThereIsNone) {
  EXPECT_EQ(find_mirror(std::vector{even(0, 0)}).verdict, MirrorVerdict::kDark);
  EXPECT_EQ(find_mirror(std::vector{even(7, 4)}).verdict, MirrorVerdict::kDark) << "a lens cap, with noise";
  EXPECT_EQ(find_mirror(std::vector{even(128, 0)}).verdict, MirrorVerdict::kEven);
  EXPECT_EQ(find_mirror(std::vector{even(128, 4)}).verdict, MirrorVerdict::kEven);
  EXPECT_EQ(find_mirror(std::vector{even(255, 0)}).verdict, MirrorVerdict::kEven);
  for (std::uint64_t seed = 2; seed <= 12; seed += 2) {
    const auto found = find_mirror(std::vector{of_rectangles(seed, 10 * static_cast<int>(seed))});
    EXPECT_TRUE(found.verdict == MirrorVerdict::kNoCircle || found.verdict == MirrorVerdict::kNoMirror)
        << "rectangles, seed " << seed << ": " << to_string(found.verdict);
  }
  EXPECT_EQ(find_mirror(std::vector{plate([](double, double) { return 200; })}).verdict, MirrorVerdict::kNoMirror)
      << "a plate";
  EXPECT_EQ(
      find_mirror(std::vector{plate([](double x, double y) { return std::hypot(x, y) < 90 ? 220 : 150; })}).verdict,
      MirrorVerdict::kNoMirror)
      << "a target of rings";
  EXPECT_EQ(find_mirror(std::vector{plate([](double x, double y) {
              return (int(x + 500) / 23 + int(y + 500) / 31) % 2 == 0 ? 220 : 150;
            })}).verdict,
            MirrorVerdict::kNoMirror)
      << "a tablecloth";
}

TEST(FindMirror, RefusesWhatIsNoImage) {
  EXPECT_THROW((void)find_mirror(std::vector<cv::Mat>{}), std::invalid_argument);
  EXPECT_THROW((void)find_mirror(std::vector{cv::Mat(48, 64, CV_8UC1)}), std::invalid_argument);
  EXPECT_THROW((void)find_mirror(std::vector{cv::Mat(48, 64, CV_8UC3), cv::Mat(48, 63, CV_8UC3)}),
               std::invalid_argument);
}

}  // namespace
}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
// Landmarks that bands tell apart, in images in which the coverage of every pixel is known.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "tests/support/synthetic_bands.h"
#include "tests/support/synthetic_lab.h"
#include "vision/bands/band_code.h"
#include "vision/bands/band_finder.h"
#include "vision/landmark_search.h"
#include "vision/outline_ranging.h"
#include "vision/paper_ranging.h"

namespace twocone::vision {
namespace {

using testing_support::banded;
using testing_support::kLine_m;
using testing_support::kPipeRadius_m;
using testing_support::pipe_of;
using testing_support::scene_of;
using testing_support::SyntheticBackground;
using testing_support::SyntheticCamera;
using testing_support::SyntheticRig;
using testing_support::SyntheticScene;

const SyntheticRig& bare_lab() {
  static const SyntheticRig rig(lab_rig());
  return rig;
}

SyntheticRig::Pair take(const SyntheticRig& rig, const SyntheticScene& scene, const SyntheticCamera& camera = {},
                        std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  return rig.take(scene, camera, random);
}

std::vector<RangeMeasurement> look(const SyntheticRig& rig, const SyntheticScene& scene,
                                   const std::vector<Landmark>& targets, const SyntheticCamera& camera = {},
                                   std::uint64_t seed = 1) {
  const auto pair = take(rig, scene, camera, seed);
  return OutlineRanging(rig.rig, targets, kImage, kImage).measure(pair.lower, pair.upper);
}

int distance(const BandCells& a, const BandCells& b) {
  int apart = 0;
  for (std::size_t i = 0; i < kBandCells; ++i) apart += a[i] != b[i] ? 1 : 0;
  return apart;
}

TEST(BandCode, NumbersDifferInFourCellsAndOnTheirHeadInTwo) {
  for (int a = 1; a <= kBandNumbers; ++a) {
    BandCells turned = band_cells(a);
    EXPECT_EQ(band_number(turned), a);
    std::ranges::reverse(turned);
    EXPECT_FALSE(band_number(turned)) << a;
    for (int b = 1; b <= kBandNumbers; ++b) {
      EXPECT_GE(distance(turned, band_cells(b)), 2) << a << " on its head, " << b;
      EXPECT_TRUE(a == b || distance(band_cells(a), band_cells(b)) >= 4) << a << ", " << b;
    }
  }
  EXPECT_THROW(static_cast<void>(band_cells(0)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(band_cells(kBandNumbers + 1)), std::invalid_argument);
}

TEST(BandCode, UpToThreeWrongCellsGiveNoNumber) {
  for (int number = 1; number <= kBandNumbers; ++number) {
    const BandCells cells = band_cells(number);
    for (std::size_t a = 0; a < kBandCells; ++a) {
      for (std::size_t b = a; b < kBandCells; ++b) {
        for (std::size_t c = b; c < kBandCells; ++c) {
          BandCells wrong = cells;
          for (const std::size_t i : {a, b, c}) wrong[i] = !cells[i];
          EXPECT_FALSE(band_number(wrong)) << number << " with cells " << a << ", " << b << " and " << c;
        }
      }
    }
  }
}

TEST(BandFinder, ReadsEveryNumberAndItsPlaceFromBandsAlone) {
  const BandFinder finder(bare_lab().rig.lower, kImage);
  for (int number = 1; number <= kBandNumbers; ++number) {
    const double range_m = 2 + 0.0125 * number;
    const Landmark landmark = banded(number, place(range_m, 0.7 * number));
    const auto pair = take(bare_lab(), scene_of({landmark}));
    const auto found = finder.find(pair.lower);
    ASSERT_EQ(found.size(), 1U) << number;
    EXPECT_EQ(found[0].number, number);
    const auto [distance_m, line_m] = finder.place_of(found[0], Bands{}.cell_m);
    EXPECT_NEAR(distance_m, range_m - kPipeRadius_m, 5 * found[0].sigma * (range_m + 0.12)) << number;
    EXPECT_NEAR(line_m, kLine_m, 5 * found[0].sigma * (kLine_m - 0.37)) << number;
  }
}

TEST(BandFinder, ReadsThroughAnyConeLensAndTiltAndInEitherSense) {
  MirrorViewSettings blunt = lab_view(0.25);
  blunt.cone.apex_rad = 1.65;
  MirrorViewSettings bent = lab_view(0.25);
  bent.distortion = LensDistortion{{-0.2, 0.03, 0, 0}, {708, 708}, {325, 236}};
  MirrorViewSettings tilted = lab_view(0.25);
  tilted.tilt_rad = {0.02, -0.03};
  MirrorViewSettings mirrored = lab_view(0.25);
  mirrored.mirrored = true;
  mirrored.azimuth_rad = 1;
  for (const MirrorViewSettings& settings : {blunt, bent, tilted, mirrored}) {
    const MirrorView view(settings);
    const testing_support::SyntheticView synthetic(view, kImage);
    for (const int number : {1, 17, 40, 64}) {
      const Landmark landmark = banded(number, place(2.8, 2.1 * number));
      std::mt19937_64 random(1);
      const auto found = BandFinder(view, kImage).find(synthetic.image(scene_of({landmark}), {}, random));
      ASSERT_EQ(found.size(), 1U) << number;
      EXPECT_EQ(found[0].number, number);
    }
  }
}

TEST(BandFinder, ReadsToFiveMetresInTheLowerViewAndToHalfOfItInTheUpperOneOverSeeds) {
  const std::array finders{BandFinder(bare_lab().rig.lower, kImage), BandFinder(bare_lab().rig.upper, kImage)};
  for (int i = 0; i < 10; ++i) {
    for (const double range_m : {2.0, 2.8, 4.0, 5.0}) {
      const Landmark landmark = banded(1 + 6 * i, place(range_m, 0.63 * i + 0.05));
      const auto pair = take(bare_lab(), scene_of({landmark}), {.noise_grey_levels = 2}, std::uint64_t(i));
      const auto lower = finders[0].find(pair.lower);
      ASSERT_EQ(lower.size(), 1U) << landmark.name << " at " << range_m << " m";
      EXPECT_EQ(lower[0].number, landmark.bands->number);
      if (range_m > 3) continue;
      const auto upper = finders[1].find(pair.upper);
      ASSERT_EQ(upper.size(), 1U) << landmark.name << " at " << range_m << " m";
      EXPECT_EQ(upper[0].number, landmark.bands->number);
    }
  }
}

TEST(BandedLandmark, AreRangedToAFewHundredthsOfAPixelWithoutNoise) {
  for (const double range_m : {1.2, 1.8, 2.4, 3.0}) {
    for (const double bearing_rad : {0.1, 0.8, 2.0, -2.5}) {
      const Landmark landmark = banded(12, place(range_m, bearing_rad));
      const auto m = look(bare_lab(), scene_of({landmark}), {landmark}).front();
      ASSERT_TRUE(m.range_m && m.bearing_rad) << range_m << " m: " << to_string(m.verdict);
      // An error of a pixel all along the bands is one of the range by the line's radius.
      const double range_px = 708 * (kLine_m - 0.37) / std::pow(range_m - kPipeRadius_m + 0.12, 2);
      EXPECT_LT(std::abs(*m.range_m - range_m) * range_px, 0.04) << range_m << " m, " << bearing_rad << " rad";
      EXPECT_LT(std::abs(std::remainder(*m.bearing_rad - bearing_rad, 2 * std::numbers::pi)) * 708 * 0.5 / range_m,
                0.05)
          << range_m << " m, " << bearing_rad << " rad";
    }
  }
}

/// Landmarks round the robot.
std::vector<Landmark> around(std::mt19937_64& random, std::size_t count, double nearest_m = 1.2) {
  std::vector<Landmark> landmarks;
  std::uniform_real_distribution<double> range_m(nearest_m, 2.8);
  std::uniform_real_distribution<double> turn_rad(-0.2, 0.2);
  for (std::size_t i = 0; i < count; ++i) {
    const double bearing_rad = 2 * std::numbers::pi * double(i) / double(count) + turn_rad(random);
    landmarks.push_back(
        banded(1 + static_cast<int>((7 * i + random() % 7) % kBandNumbers), place(range_m(random), bearing_rad)));
  }
  return landmarks;
}

TEST(BandedLandmark, SigmasHoldTheTruthOverSeeds) {
  std::mt19937_64 random(5);
  const SyntheticRig chequered(lab_rig(), SyntheticBackground{.level = 0.4, .cells = 9, .contrast = 0.6});
  double chi_squared = 0;
  int answers = 0;
  int lost = 0;
  for (int image = 0; image < 12; ++image) {
    const auto landmarks = around(random, 6);
    const SyntheticRig& rig = image % 2 == 0 ? bare_lab() : chequered;
    SyntheticScene scene = scene_of(landmarks);
    scene.shading = {.ambient = 0.5, .diffuse = 0.5, .light_bearing_rad = double(image), .top = 1};
    const auto measured = look(rig, scene, landmarks, {.noise_grey_levels = 2}, std::uint64_t(image));
    for (std::size_t k = 0; k < landmarks.size(); ++k) {
      const RangeMeasurement& m = measured[k];
      if (!m.range_m || !m.bearing_rad) {
        ++lost;
        continue;
      }
      const Eigen::Vector2d at = place_m(landmarks[k]);
      const Eigen::Vector2d error(*m.range_m - at.norm(),
                                  std::remainder(*m.bearing_rad - std::atan2(at.y(), at.x()), 2 * std::numbers::pi));
      const double squared = error.dot(m.covariance->ldlt().solve(error));
      EXPECT_LT(squared, 30) << landmarks[k].name << " in image " << image << ", at " << at.norm()
                             << " m: " << 1000 * error.x() << " mm, sigma " << 1000 * *m.sigma_range_m;
      chi_squared += squared;
      ++answers;
    }
  }
  EXPECT_LE(lost, 4);
  EXPECT_LT(chi_squared / (2 * answers), 1.6);
  EXPECT_GT(chi_squared / (2 * answers), 0.4);
}

TEST(BandedLandmark, TellApartWhatIsNoLandmark) {
  const Landmark landmark = banded(20, place(2, 0.5));
  const Landmark copy = banded(20, place(2.2, 2.5));
  EXPECT_EQ(look(bare_lab(), scene_of({landmark, copy}), {landmark}).front().verdict, RangeVerdict::kTwoCandidates);
  EXPECT_EQ(look(bare_lab(), scene_of({banded(21, place(2, 0.5))}), {landmark}).front().verdict,
            RangeVerdict::kNotSeen);
  Landmark lower = landmark;
  lower.top_m -= 0.15;
  EXPECT_EQ(look(bare_lab(), scene_of({landmark}), {lower}).front().verdict, RangeVerdict::kInconsistent);
  Landmark thicker = landmark;
  thicker.radius_m *= 1.4;
  const auto m = look(bare_lab(), scene_of({landmark}), {thicker}).front();
  EXPECT_NE(m.verdict, RangeVerdict::kOk) << "a radius that is wrong by 2 cm";
  EXPECT_EQ(look(bare_lab(), scene_of({landmark, copy}), {landmark, copy})[1].verdict, RangeVerdict::kSameColour);
}

TEST(BandedLandmark, SigmasHoldTheTruthWhereTheLineIsNotWhereTheMapHasItOverSeeds) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> off_m(0, 0.01);
  double chi_squared = 0;
  int answers = 0;
  for (int image = 0; image < 8; ++image) {
    const auto landmarks = around(random, 6);
    std::vector<Landmark> believed = landmarks;
    BeliefErrors errors;
    errors.rig = BySharedErrors<kRigNumbers>::Zero(kRigNumbers, 6);
    for (std::size_t k = 0; k < believed.size(); ++k) {
      believed[k].top_m += off_m(random);
      errors.landmarks.emplace_back(BySharedErrors<kLandmarkNumbers>::Zero(kLandmarkNumbers, 6));
      errors.landmarks.back()(kTop, Eigen::Index(k)) = 0.01;
    }
    const auto pair = take(bare_lab(), scene_of(landmarks), {.noise_grey_levels = 2}, std::uint64_t(image));
    const auto measured =
        OutlineRanging(lab_rig(), believed, kImage, kImage, {}, errors).measure(pair.lower, pair.upper);
    for (std::size_t k = 0; k < landmarks.size(); ++k) {
      const RangeMeasurement& m = measured[k];
      if (!m.range_m) continue;
      const double off = *m.range_m - place_m(landmarks[k]).norm();
      chi_squared += off * off / (*m.sigma_range_m * *m.sigma_range_m);
      ++answers;
      // Sightings are of the line where it is, wherever the map has it.
      const std::array<const std::optional<Sighting>*, 2> both{&m.lower_sighting, &m.upper_sighting};
      for (std::size_t view = 0; view < 2; ++view) {
        if (!*both[view]) continue;
        const MirrorView& mirror = view == 0 ? bare_lab().rig.lower : bare_lab().rig.upper;
        const auto near_m = near_top_point(mirror, place_m(landmarks[k]), landmarks[k].radius_m, landmarks[k].top_m);
        const Eigen::Vector2d apart_px = (*both[view])->pixel_px - mirror.project(*near_m).value();
        EXPECT_LT(apart_px.dot((*both[view])->covariance_px2.ldlt().solve(apart_px)), 30)
            << landmarks[k].name << " in image " << image << ": " << apart_px.transpose() << " px";
        EXPECT_LT(apart_px.norm(), 0.3) << landmarks[k].name << " in image " << image;
      }
    }
  }
  EXPECT_GE(answers, 40);
  EXPECT_LT(chi_squared / answers, 1.6);
  EXPECT_GT(chi_squared / answers, 0.2);
}

// As in a survey. The doubt of range and height cancels in the pixel, and rounding must not leave its covariance such
// that nothing takes it.
TEST(BandedLandmark, AreRangedHoweverLittleIsKnownOfTheirHeight) {
  std::mt19937_64 random(3);
  for (const double top_sigma_m : {0.03, 1.0, 30.0, 1000.0}) {
    const auto landmarks = around(random, 6);
    BeliefErrors errors;
    errors.rig = BySharedErrors<kRigNumbers>::Zero(kRigNumbers, 6);
    for (std::size_t k = 0; k < landmarks.size(); ++k) {
      errors.landmarks.emplace_back(BySharedErrors<kLandmarkNumbers>::Zero(kLandmarkNumbers, 6));
      errors.landmarks.back()(kTop, Eigen::Index(k)) = top_sigma_m;
    }
    const auto pair = take(bare_lab(), scene_of(landmarks), {.noise_grey_levels = 2}, 1);
    const OutlineRanging ranging(lab_rig(), landmarks, kImage, kImage, {}, errors);
    const auto measured = ranging.measure(pair.lower, pair.upper);
    for (const RangeMeasurement& m : measured) {
      for (const auto* sighting : {&m.lower_sighting, &m.upper_sighting}) {
        if (!*sighting) continue;
        const Eigen::Matrix2d& covariance = (*sighting)->covariance_px2;
        EXPECT_EQ(covariance(0, 1), covariance(1, 0)) << top_sigma_m;
        EXPECT_GT(covariance.determinant(), 0) << top_sigma_m;
      }
    }
    EXPECT_GE(std::ranges::count_if(measured, [](const RangeMeasurement& m) { return m.range_m.has_value(); }), 4);
  }
}

TEST(BandedLandmark, WhatHidesAPartIsNeverQuietlyWrong) {
  const Landmark landmark = banded(33, place(2, 0.3));
  int answers = 0;
  for (int i = -12; i <= 12; ++i) {
    SyntheticScene scene = scene_of({landmark});
    scene.strips.push_back({.bearing_rad = 0.3 + 0.003 * i,
                            .distance_m = 0.3,
                            .half_width_m = 0.004,
                            .colour = Eigen::Vector3d::Constant(i % 2 == 0 ? 0.02 : 0.6)});
    const auto m = look(bare_lab(), scene, {landmark}).front();
    if (!m.range_m) continue;
    ++answers;
    EXPECT_LT(std::abs(*m.range_m - 2), std::max(0.003, 4 * *m.sigma_range_m)) << i;
    if (!m.bearing_rad) continue;
    EXPECT_LT(std::abs(*m.bearing_rad - 0.3), std::max(0.002, 4 * *m.sigma_bearing_rad)) << i;
  }
  EXPECT_GE(answers, 4);
}

TEST(BandedLandmark, StandBesideColouredOnes) {
  std::vector<Landmark> targets = testing_support::targets_of(testing_support::six_landmarks());
  SyntheticScene scene;
  scene.landmarks = testing_support::six_landmarks();
  for (const Landmark& landmark : {banded(2, place(1.8, 0.4)), banded(3, place(1.9, -1.5))}) {
    targets.insert(targets.begin() + 2, landmark);
    const auto pipe = pipe_of(landmark);
    scene.landmarks.insert(scene.landmarks.end(), pipe.begin(), pipe.end());
  }
  const auto pair = take(bare_lab(), scene);
  const auto all = OutlineRanging(lab_rig(), targets, kImage, kImage).measure(pair.lower, pair.upper);
  for (std::size_t k = 0; k < targets.size(); ++k) {
    ASSERT_TRUE(all[k].range_m) << targets[k].name << ": " << to_string(all[k].verdict);
    EXPECT_NEAR(*all[k].range_m, place_m(targets[k]).norm(), 0.004) << targets[k].name;
  }
  // The paper's method knows hues alone.
  const auto paper = PaperRanging(lab_rig(), targets, kImage, kImage).measure(pair.lower, pair.upper);
  for (std::size_t k = 0; k < targets.size(); ++k) {
    EXPECT_EQ(paper[k].range_m.has_value(), !targets[k].bands) << targets[k].name;
  }
}

TEST(BandedLandmark, AreFoundWithoutAMap) {
  std::mt19937_64 random(9);
  const auto landmarks = around(random, 5, 1.9);
  const auto pair = take(bare_lab(), scene_of(landmarks));
  const auto things = LandmarkSearch(lab_rig(), {}, kImage, kImage).look(pair.lower, pair.upper);
  ASSERT_EQ(things.size(), landmarks.size());
  for (const RoughLandmark& thing : things) {
    const Landmark looks = looking_like(thing.hue, {});
    ASSERT_TRUE(looks.bands);
    const auto same = [&](const Landmark& l) { return l.bands->number == looks.bands->number; };
    const auto landmark = std::ranges::find_if(landmarks, same);
    ASSERT_NE(landmark, landmarks.end()) << looks_of(looks);
    EXPECT_NEAR(thing.range_m, place_m(*landmark).norm(), 0.1) << looks_of(looks);
    EXPECT_NEAR(thing.top_m, kLine_m, 0.03) << looks_of(looks);
    EXPECT_NEAR(thing.radius_m, kPipeRadius_m, 0.02) << looks_of(looks);
  }
}

}  // namespace
}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#include "localisation/map_filter.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "tests/localisation/a_drive.h"
#include "tests/vision/lab_rig.h"
#include "vision/triangulation.h"

namespace twocone::localisation {
namespace {

using vision::Side;

constexpr double kPixelSigma_px = 0.3;
constexpr double kFarthest_m = 3.5;
constexpr std::size_t kHues = 5;

/// Sixteen landmarks on both sides of the circle of 2.25 m on which the robot drives, of five hues: each hue comes
/// again after a third of the way.
std::vector<Landmark> ring() {
  std::vector<Landmark> landmarks;
  const Pose start = Drive(1).truth();
  const Eigen::Vector2d middle_m(start.x_m - 2.25 * std::sin(start.heading_rad),
                                 start.y_m + 2.25 * std::cos(start.heading_rad));
  for (std::size_t i = 0; i < 16; ++i) {
    const double angle = 2 * std::numbers::pi * double(i) / 16 + 0.1;
    const double far_m = i % 2 == 0 ? 3.4 : 0.9;
    landmarks.push_back({.x_m = middle_m.x() + far_m * std::cos(angle),
                         .y_m = middle_m.y() + far_m * std::sin(angle),
                         .radius_m = 0.06 + 0.002 * double(i),
                         .top_m = 0.9 + 0.02 * double(i % 3)});
  }
  return landmarks;
}

/// What the rig shows of the landmarks from a pose, with noise.
std::vector<vision::RoughLandmark> things_from(const Pose& pose, const std::vector<Landmark>& landmarks,
                                               const vision::Rig& rig, std::mt19937_64& random) {
  std::normal_distribution<> noise(0, kPixelSigma_px);
  std::vector<vision::RoughLandmark> things;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const Eigen::Vector2d place_m = in_body(pose, vision::place_m(landmarks[i]));
    if (place_m.norm() > kFarthest_m || place_m.norm() < 0.4) continue;
    vision::RoughLandmark thing{.hue = i % kHues};
    bool is_shown = true;
    for (const Side side : {Side::kLower, Side::kUpper}) {
      const vision::MirrorView& view = of_view(rig, side);
      const auto near_m = near_top_point(view, place_m, landmarks[i].radius_m, landmarks[i].top_m);
      const auto pixel = near_m ? view.project(*near_m) : std::nullopt;
      is_shown = is_shown && pixel.has_value();
      if (!is_shown) break;
      vision::Sighting& seen = thing.views[std::size_t(side)];
      seen.pixel_px = *pixel + Eigen::Vector2d(noise(random), noise(random));
      seen.covariance_px2 *= kPixelSigma_px * kPixelSigma_px;
    }
    if (!is_shown) continue;
    // The believed rig, not the true one, says where that is.
    const auto met = triangulate(vision::lab_rig(), thing.views.data(), &thing.views[1], landmarks[i].radius_m, {});
    if (met.verdict != vision::RangeVerdict::kOk) continue;
    thing.range_m = *met.range_m;
    thing.bearing_rad = *met.bearing_rad;
    thing.top_m = *met.top_m;
    thing.radius_m = landmarks[i].radius_m * 0.95;
    things.push_back(thing);
  }
  return things;
}

/// A drive of one and a half turns on the circle.
struct Tour {
  MapFilter filter;
  Pose truth;
  std::vector<Landmark> landmarks;

  /// Squared distance of pose and landmarks from the truth over their stated variances, one number each.
  [[nodiscard]] double landmarks_chi_squared() const {
    double sum = 0;
    for (std::size_t i = 0; i < filter.size(); ++i) {
      const FoundLandmark found = filter.landmark(i);
      const Eigen::Vector4d error = found.numbers - nearest(found);
      sum += error.dot(found.covariance.ldlt().solve(error));
    }
    return sum;
  }
  [[nodiscard]] Eigen::Vector4d nearest(const FoundLandmark& found) const {
    const auto apart = [&](const Landmark& l) { return (vision::place_m(l) - found.numbers.head<2>()).norm(); };
    const Landmark& l = *std::ranges::min_element(landmarks, {}, apart);
    return {l.x_m, l.y_m, l.top_m, l.radius_m};
  }
};

/// @param change of what a frame shows
Tour drive_round(std::uint64_t seed, const vision::Rig& true_rig, const vision::BeliefErrors& errors,
                 const std::function<void(std::vector<vision::RoughLandmark>&, std::mt19937_64&)>& change = {}) {
  Drive drive(seed);
  std::mt19937_64 random(seed + 100);
  Tour tour{MapFilter(vision::lab_rig(), errors, kWheels, kNoise, {}, drive.truth()), {}, ring()};
  drive.report_readings(tour.filter);
  for (int step = 0; step < 1060; ++step) {
    drive.step(5.6, 6.4);
    drive.report_readings(tour.filter);
    if (step % 8 != 0) continue;
    auto things = things_from(drive.truth(), tour.landmarks, true_rig, random);
    if (change) change(things, random);
    tour.filter.observe(things);
  }
  tour.truth = drive.truth();
  return tour;
}

// Catches landmarks that are added twice or confused with another of their hue, and variances that are too small. Each
// has 4 numbers; errors of one filter are correlated, so that the band is that of 20 seeds: 3200 with 4 sigmas of the
// mean over seeds.
TEST(MapFilter, KnowsHowFarItsMapAndItsPoseAreFromTheTruthSeeds) {
  double landmarks = 0;
  double poses = 0;
  constexpr int kSeeds = 20;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const Tour tour = drive_round(std::uint64_t(seed), vision::lab_rig(), {});
    ASSERT_EQ(tour.filter.size(), 16U) << seed;
    for (std::size_t i = 0; i < 16; ++i) {
      const FoundLandmark found = tour.filter.landmark(i);
      EXPECT_LT((found.numbers - tour.nearest(found)).head<2>().norm(), 0.1) << seed << " " << i;
      EXPECT_GT(found.sightings, 10U);
    }
    landmarks += tour.landmarks_chi_squared() / 64;
    const PoseEstimate pose = tour.filter.pose();
    const Eigen::Vector3d error(pose.pose.x_m - tour.truth.x_m, pose.pose.y_m - tour.truth.y_m,
                                wrap_angle_rad(pose.pose.heading_rad - tour.truth.heading_rad));
    poses += error.dot(pose.covariance.ldlt().solve(error)) / 3;
  }
  EXPECT_GT(landmarks / kSeeds, 0.5);
  EXPECT_LT(landmarks / kSeeds, 1.5);
  EXPECT_GT(poses / kSeeds, 0.4);
  EXPECT_LT(poses / kSeeds, 1.8);
}

// Catches a measured radius that is left out, or whose variance does not reach the places that depend on it.
TEST(MapFilter, CountsRadiiThatWereMeasured) {
  double chi_squared = 0;
  constexpr int kSeeds = 8;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Tour by_place = drive_round(seed, vision::lab_rig(), {});
    const Tour tour = drive_round(seed, vision::lab_rig(), {}, [](auto& things, auto& random) {
      for (vision::RoughLandmark& thing : things) {
        thing.radius_m = thing.radius_m / 0.95 + std::normal_distribution<>(0, 0.004)(random);
        thing.radius_sigma_m = 0.004;
      }
    });
    ASSERT_EQ(tour.filter.size(), 16U);
    for (std::size_t i = 0; i < tour.filter.size(); ++i) {
      const double variance = tour.filter.landmark(i).covariance(vision::kRadius, vision::kRadius);
      EXPECT_LT(variance, 0.5 * by_place.filter.landmark(i).covariance(vision::kRadius, vision::kRadius));
    }
    chi_squared += tour.landmarks_chi_squared();
  }
  const double numbers = 4.0 * 16 * kSeeds;
  EXPECT_LT(chi_squared, numbers + 4 * std::sqrt(2 * numbers)) << "of " << numbers;
}

// Catches a view that does not show a thing and counts nevertheless, one that is lost because the other does not, and
// variances that do not fit: of two thirds of the things only one view counts, and the other has a sighting without
// meaning.
TEST(MapFilter, CountsWhatOneViewShows) {
  double one = 0;
  double none = 0;
  double chi_squared = 0;
  constexpr int kSeeds = 8;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Tour tour = drive_round(seed, vision::lab_rig(), {}, [](auto& things, auto& random) {
      for (vision::RoughLandmark& thing : things) {
        const auto hidden = random() % 3;
        if (hidden == 2) continue;
        thing.is_shown[hidden] = false;
        thing.views[hidden].pixel_px = {-1000, -1000};
      }
    });
    const Tour without = drive_round(seed, vision::lab_rig(), {}, [](auto& things, auto& random) {
      std::erase_if(things, [&](const auto&) { return random() % 3 != 2; });
    });
    ASSERT_EQ(tour.filter.size(), 16U) << seed;
    one += tour.filter.pose().covariance.topLeftCorner<2, 2>().trace();
    none += without.filter.pose().covariance.topLeftCorner<2, 2>().trace();
    chi_squared += tour.landmarks_chi_squared();
  }
  EXPECT_LT(one, 0.9 * none);
  const double numbers = 4.0 * 16 * kSeeds;
  EXPECT_LT(chi_squared, numbers + 4 * std::sqrt(2 * numbers)) << "of " << numbers;
}

// Catches a landmark that begins with what one view shows, of which no range is known.
TEST(MapFilter, AddsNothingThatOneViewShowsAlone) {
  std::mt19937_64 random(1);
  auto things = things_from({}, {{.x_m = 1.5, .y_m = 0.4, .radius_m = 0.08, .top_m = 0.9}}, vision::lab_rig(), random);
  ASSERT_EQ(things.size(), 1U);
  things[0].is_shown[1] = false;
  MapFilter filter(vision::lab_rig(), {}, kWheels, kNoise, {}, {});
  filter.predict(0, 0, 0);
  EXPECT_EQ(filter.observe(things), std::vector<std::optional<std::size_t>>{std::nullopt});
  EXPECT_EQ(filter.size(), 0U);
}

// Catches radii that become negative: of a thin landmark only a rough radius is known, and all else is measured so well
// that a residual of some pixels would ask for one.
TEST(MapFilter, KeepsRadiiPositive) {
  std::mt19937_64 random(2);
  std::vector<Landmark> thin{{.x_m = 1.5, .y_m = 0.4, .radius_m = 0.004, .top_m = 0.9}};
  MapFilter filter(vision::lab_rig(), {}, kWheels, kNoise, {}, {});
  for (int i = 0; i < 40; ++i) {
    filter.predict(i, 0, 0);
    auto things = things_from({}, thin, vision::lab_rig(), random);
    for (vision::RoughLandmark& thing : things) thing.radius_m = 0.03;
    filter.observe(things);
    ASSERT_EQ(filter.size(), 1U);
    ASSERT_GT(filter.landmark(0).numbers[vision::kRadius], 0);
  }
}

TEST(MapFilter, SaysWhatAViewWouldShow) {
  std::mt19937_64 random(3);
  MapFilter filter(vision::lab_rig(), {}, kWheels, kNoise, {}, {});
  filter.predict(0, 0, 0);
  filter.observe(things_from({}, {{.x_m = 2, .y_m = 0, .radius_m = 0.08, .top_m = 0.9}}, vision::lab_rig(), random));
  ASSERT_EQ(filter.size(), 1U);
  EXPECT_TRUE(filter.is_in_view(0));
  // Half a metre before it, the top is above what either mirror shows.
  filter.predict(1, 30, 30);
  EXPECT_FALSE(filter.is_in_view(0)) << filter.pose().pose.x_m;
}

// Catches shared errors that average away: the upper mirror is 3 mm higher than believed, which makes all of the map
// two per cent too small. Without the error in the covariance the map is surprised by the truth, with it it is not.
TEST(MapFilter, AWrongRigCountsInTheCovarianceHoweverLongTheDriveIs) {
  vision::MirrorViewSettings upper = vision::lab_view(0.55);
  upper.lens_height_m += 0.003;
  const vision::Rig true_rig{vision::lab_rig().lower, vision::MirrorView(upper)};
  vision::BeliefErrors errors;
  errors.rig = BySharedErrors<vision::kRigNumbers>::Zero(vision::kRigNumbers, 1);
  EXPECT_GT(drive_round(3, true_rig, errors).landmarks_chi_squared() / 64, 10);
  errors.rig(vision::kSeparation, 0) = 0.003;
  EXPECT_LT(drive_round(3, true_rig, errors).landmarks_chi_squared() / 64, 2);
}

TEST(MapFilter, ForgetsALandmarkThatIsRemoved) {
  Tour tour = drive_round(5, vision::lab_rig(), {});
  const FoundLandmark second = tour.filter.landmark(1);
  tour.filter.remove(0);
  EXPECT_EQ(tour.filter.size(), 15U);
  EXPECT_EQ(tour.filter.landmark(0).numbers, second.numbers);
  EXPECT_EQ(tour.filter.landmark(0).covariance, second.covariance);
  EXPECT_THROW((void)tour.filter.landmark(15), std::out_of_range);
}

// A thing that is neither a known landmark nor far enough from it to be another one is left out.
TEST(MapFilter, LeavesOutWhatMayBeEither) {
  std::mt19937_64 random(1);
  std::vector<Landmark> one{{.x_m = 1.5, .y_m = 0.4, .radius_m = 0.08, .top_m = 0.9}};
  MapFilter filter(vision::lab_rig(), {}, kWheels, kNoise, {}, {});
  filter.predict(0, 0, 0);
  ASSERT_EQ(filter.observe(things_from({}, one, vision::lab_rig(), random)),
            std::vector<std::optional<std::size_t>>{0});
  one[0].y_m += 0.25;
  EXPECT_EQ(filter.observe(things_from({}, one, vision::lab_rig(), random)),
            std::vector<std::optional<std::size_t>>{std::nullopt});
  one[0].y_m += 0.6;
  EXPECT_EQ(filter.observe(things_from({}, one, vision::lab_rig(), random)),
            std::vector<std::optional<std::size_t>>{1});
  EXPECT_EQ(filter.frames(), 3U);
}

TEST(MapFilter, RefusesReadingsThatAreNotFiniteOrRunBackwards) {
  MapFilter filter(vision::lab_rig(), {}, kWheels, kNoise, {}, {});
  filter.predict(1, 0, 0);
  EXPECT_THROW(filter.predict(0.5, 0, 0), std::invalid_argument);
  EXPECT_THROW(filter.predict(2, NAN, 0), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::localisation

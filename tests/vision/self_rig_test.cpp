// SPDX-License-Identifier: Apache-2.0
#include "vision/self_rig.h"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/mirror_in_room.h"
#include "tests/support/synthetic_lab.h"

namespace twocone::vision {
namespace {

using namespace testing_support;

// As mirror_search_test.cpp.
constexpr double kRim_px = 1.0;
// Four of the stated sigmas; one in 16,000 of a Gaussian is beyond, so with fixed seeds a failure is a change.
constexpr double kSigmas = 4;

/// What a case plants.
struct PlantedRig {
  std::array<Eigen::Vector2d, 2> centre_px;
  std::array<double, 2> radius_px{};
  std::array<double, 2> azimuth_rad{};
  std::array<bool, 2> mirrored{};
  bool exchanged = false;
  std::array<Surroundings, 2> surroundings{};
  double noise = 0;
  bool has_mast = false;
  double contrast = 0.3;    ///< of the background, which changes at the horizon, a circle within the rim
  bool sees_floor = false;  ///< mirrors of 112 degrees, and landmarks that are lower than the upper one
  double tilt_rad = 0;      ///< of both mirrors, in opposite directions
};

/// Centres up to 40 px off, rims up to 20 %, cameras turned by any angle.
PlantedRig planted(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto coin = [&] { return uniform(random) > 0; };
  PlantedRig p;
  for (const std::size_t i : {0, 1}) {
    p.centre_px[i] = {319.5 + 40 * uniform(random), 239.5 + 40 * uniform(random)};
    p.radius_px[i] = 236 * (1 + 0.2 * uniform(random));
    p.azimuth_rad[i] = std::numbers::pi * uniform(random);
    p.mirrored[i] = coin();
    p.surroundings[i] = Surroundings((int(seed) + 2 * int(i)) % kSurroundings);
  }
  p.exchanged = coin();
  p.noise = 1.5 + 1.5 * uniform(random);
  p.has_mast = coin();
  return p;
}

MirrorViewSettings believed_view(const PlantedRig& p, std::size_t i) {
  if (!p.sees_floor) return lab_view(i == 0 ? 0.25 : 0.55);
  MirrorViewSettings s = lab_view(i == 0 ? 0.14 : 0.38);
  s.cone = {.apex_rad = 112 * std::numbers::pi / 180, .rim_radius_m = 0.08, .lens_to_tip_m = 0.08};
  return s;
}

std::vector<SyntheticLandmark> landmarks_of(const PlantedRig& p) {
  std::vector<SyntheticLandmark> landmarks = six_landmarks();
  for (SyntheticLandmark& l : landmarks) {
    if (p.sees_floor) l.top_m = 0.3;
  }
  return landmarks;
}

Rig true_rig(const PlantedRig& p) {
  const auto view = [&](std::size_t i) {
    MirrorViewSettings s = believed_view(p, i);
    s.centre_px = p.centre_px[i];
    s.rim_radius_px = p.radius_px[i];
    s.azimuth_rad = p.azimuth_rad[i];
    s.mirrored = p.mirrored[i];
    s.tilt_rad = (i == 0 ? 1 : -1) * p.tilt_rad * Eigen::Vector2d(0.8, 0.6);
    return MirrorView(s);
  };
  return {view(0), view(1)};
}

/// A drive in the lab, curved left and then right.
const std::vector<Pose2> kDrive{{0.3, -0.2, 0.9}, {0.52, 0.05, 1.3}, {0.6, 0.42, 0.85}, {0.93, 0.66, 0.2}};

Pose2 between(const Pose2& from, const Pose2& to) {
  const double dx = to.x_m - from.x_m;
  const double dy = to.y_m - from.y_m;
  const double c = std::cos(from.heading_rad);
  const double s = std::sin(from.heading_rad);
  return {c * dx + s * dy, -s * dx + c * dy, to.heading_rad - from.heading_rad};
}

std::vector<SelfRigFrame> take(const PlantedRig& p, std::uint64_t seed, const std::vector<Pose2>& poses) {
  std::mt19937_64 random(seed + 1000);
  const SyntheticRig synthetic(true_rig(p), {.level = 0.35, .swing = 0.2, .cells = 9, .contrast = p.contrast});
  std::vector<SelfRigFrame> frames;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    SyntheticScene scene;
    scene.landmarks = seen_from(landmarks_of(p), {poses[i].x_m, poses[i].y_m}, poses[i].heading_rad);
    if (p.has_mast) scene.strips.push_back({2.3, 0.12, 0.01, {0.05, 0.05, 0.05}});
    auto pair = synthetic.take(scene, {}, random);
    surround(pair.lower, p.centre_px[0], p.radius_px[0], p.surroundings[0]);
    surround(pair.upper, p.centre_px[1], p.radius_px[1], p.surroundings[1]);
    add_noise(pair.lower, p.noise, random);
    add_noise(pair.upper, p.noise, random);
    if (p.exchanged) std::swap(pair.lower, pair.upper);
    SelfRigFrame& frame = frames.emplace_back();
    frame.lower = pair.lower;
    frame.upper = pair.upper;
    if (i > 0) frame.motion = between(poses[i - 1], poses[i]);
  }
  return frames;
}

SelfRigProblem problem_of(std::vector<SelfRigFrame> frames) {
  return {.rig = lab_rig(), .landmarks = targets_of(six_landmarks()), .frames = std::move(frames)};
}

void expect_angle(const FoundAngle& found, double truth_rad, const char* what) {
  ASSERT_TRUE(found.rad) << what << ": " << to_string(found.reason);
  EXPECT_NEAR(base::wrap_angle_rad(*found.rad - truth_rad), 0, kSigmas * found.sigma_rad) << what;
  EXPECT_LT(found.sigma_rad, 0.15) << what << " that is hardly known is no answer";
}

void expect_found(const SelfRig& found, const SelfRigProblem& problem, const PlantedRig& p) {
  ASSERT_EQ(found.missing(), NotFound::kNothing)
      << to_string(found.missing()) << "; exchanged " << to_string(found.exchanged.reason) << ", mirrored "
      << to_string(found.views[0].mirrored.reason) << " " << to_string(found.views[1].mirrored.reason);
  EXPECT_EQ(found.exchanged.value, p.exchanged);
  const Rig rig = to_rig(found, problem);
  for (const std::size_t i : {0, 1}) {
    const MirrorViewSettings& s = (i == 0 ? rig.lower : rig.upper).settings();
    EXPECT_NEAR((s.centre_px - p.centre_px[i]).norm(), 0, kRim_px) << i;
    EXPECT_NEAR(s.rim_radius_px, p.radius_px[i], kRim_px) << i;
    EXPECT_EQ(s.mirrored, p.mirrored[i]) << i;
  }
  expect_angle(found.relative_azimuth, p.azimuth_rad[1] - p.azimuth_rad[0], "relative azimuth");
}

// Catches any of the four answers that depends on the others being the usual ones.
TEST(FindRig, FindsEverythingFromADrive) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const PlantedRig p = planted(seed);
    const SelfRigProblem problem = problem_of(take(p, seed, kDrive));
    const SelfRig found = find_rig(problem);
    expect_found(found, problem, p);
    expect_angle(found.azimuth, p.azimuth_rad[0], "azimuth");
  }
}

// Catches a search that needs landmarks higher than both mirrors.
TEST(FindRig, FindsMirrorsThatLookDownAtTheLandmarks) {
  for (std::uint64_t seed = 41; seed <= 42; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    PlantedRig p = planted(seed);
    p.sees_floor = true;
    if (seed != 42) p.contrast = 0;
    for (double& radius_px : p.radius_px) radius_px *= 0.85;
    const SelfRigProblem problem{.rig = {MirrorView(believed_view(p, 0)), MirrorView(believed_view(p, 1))},
                                 .landmarks = targets_of(landmarks_of(p)),
                                 .frames = take(p, seed, kDrive)};
    expect_found(find_rig(problem), problem, p);
    if (seed == 42) continue;
    SelfRigProblem twice = problem;
    for (SelfRigFrame& frame : twice.frames) frame.upper = frame.lower;
    EXPECT_FALSE(find_rig(twice).exchanged.value);
  }
}

// Catches ranges that are believed where the tops are near the horizon: mirrors that are tilted by two degrees may show
// a top at twice its distance, or on the wrong side of the horizon.
TEST(FindRig, FindsTiltedMirrorsWhoseLandmarksEndNearTheHorizon) {
  for (std::uint64_t seed = 51; seed <= 52; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    PlantedRig p = planted(seed);
    p.sees_floor = true;
    p.contrast = 0;
    p.tilt_rad = 0.035;
    for (double& radius_px : p.radius_px) radius_px *= 0.85;
    SelfRigProblem problem{.rig = {MirrorView(believed_view(p, 0)), MirrorView(believed_view(p, 1))},
                           .landmarks = targets_of(landmarks_of(p)),
                           .frames = take(p, seed, kDrive)};
    const SelfRig moved = find_rig(problem);
    ASSERT_EQ(moved.missing(), NotFound::kNothing);
    expect_angle(moved.relative_azimuth, p.azimuth_rad[1] - p.azimuth_rad[0], "relative azimuth");
    expect_angle(moved.azimuth, p.azimuth_rad[0], "azimuth by the drive");
    const Rig truth = true_rig(p);
    for (const Side camera : {Side::kLower, Side::kUpper}) {
      const SelfView& view = moved.views[std::size_t(camera)];
      ASSERT_TRUE(view.tilt_rad) << to_string(camera);
      const Side mirror = p.exchanged == (camera == Side::kLower) ? Side::kUpper : Side::kLower;
      const Eigen::Vector2d off_rad = *view.tilt_rad - of_view(truth, mirror).settings().tilt_rad;
      EXPECT_LT(off_rad.norm(), kSigmas * view.sigma_tilt_rad) << to_string(camera);
      EXPECT_LT(view.sigma_tilt_rad, 0.01) << to_string(camera);
    }
    problem.frames.resize(1);
    problem.frames[0].heading_rad = kDrive[0].heading_rad;
    expect_angle(find_rig(problem).azimuth, p.azimuth_rad[0], "azimuth by the heading");
  }
}

// Catches a finder that needs motion, and an azimuth that ignores a known heading.
TEST(FindRig, FindsEverythingInOneFrameWithAHeading) {
  for (std::uint64_t seed = 21; seed <= 22; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const PlantedRig p = planted(seed);
    SelfRigProblem problem = problem_of(take(p, seed, {kDrive[1]}));
    problem.has_believed_circles = false;
    EXPECT_EQ(find_rig(problem).azimuth.reason, NotFound::kNoMotion);
    problem.frames[0].heading_rad = kDrive[1].heading_rad;
    const SelfRig found = find_rig(problem);
    expect_found(found, problem, p);
    expect_angle(found.azimuth, p.azimuth_rad[0], "azimuth");
  }
}

// Catches an answer that is made up where the images have none.
TEST(FindRig, SaysWhatIsMissing) {
  const PlantedRig p = planted(31);
  const std::vector<SelfRigFrame> good = take(p, 31, {kDrive[0]});
  const auto changed = [&](const auto& change) {
    SelfRigProblem problem = problem_of({{good[0].lower.clone(), good[0].upper.clone()}});
    change(problem);
    return find_rig(problem);
  };
  EXPECT_EQ(changed([](auto&) {}).missing(), NotFound::kNothing);

  const SelfRig cap = changed([](auto& problem) { problem.frames[0].upper.setTo(cv::Scalar::all(3)); });
  EXPECT_EQ(cap.missing(), NotFound::kNoMirror);
  EXPECT_EQ(cap.views[0].mirror.verdict, MirrorVerdict::kFound);
  EXPECT_EQ(cap.views[1].mirror.verdict, MirrorVerdict::kDark);

  const SelfRig twice = changed([](auto& problem) { problem.frames[0].upper = problem.frames[0].lower; });
  EXPECT_EQ(twice.missing(), NotFound::kUndecided);
  EXPECT_TRUE(twice.shows_one_mirror);

  const SelfRig grey = changed([](auto& problem) {
    for (cv::Mat* image : {&problem.frames[0].lower, &problem.frames[0].upper}) {
      for (cv::Vec3b& pixel : cv::Mat_<cv::Vec3b>(*image)) pixel = cv::Vec3b::all(pixel[1]);
    }
  });
  EXPECT_EQ(grey.missing(), NotFound::kNoLandmarks);

  // Colours that were exchanged in the map: no pose explains them.
  const SelfRig other_map = changed([](auto& problem) {
    std::swap(problem.landmarks[0].colour, problem.landmarks[3].colour);
    std::swap(problem.landmarks[1].colour, problem.landmarks[2].colour);
    std::swap(problem.landmarks[4].colour, problem.landmarks[2].colour);
  });
  EXPECT_NE(other_map.missing(), NotFound::kNothing);

  EXPECT_THROW((void)find_rig(problem_of({})), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::vision

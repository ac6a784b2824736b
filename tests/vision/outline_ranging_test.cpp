// SPDX-License-Identifier: Apache-2.0
// Tests of the vision part of method `outline` on images in which the coverage of every pixel is known.
#include "vision/outline_ranging.h"

#include <array>
#include <cstdlib>

#include <gtest/gtest.h>

#include "tests/support/synthetic_lab.h"
#include "tests/vision/image_quality_images.h"
#include "tests/vision/robot_as_built.h"
#include "vision/srgb.h"

namespace twocone::vision {
namespace {

using testing_support::landmark;
using testing_support::seen_from;
using testing_support::six_landmarks;
using testing_support::SyntheticCamera;
using testing_support::SyntheticLandmark;
using testing_support::SyntheticRig;
using testing_support::SyntheticScene;
using testing_support::targets_of;

// The sides of a landmark are long, its top is short. Without noise, the remaining errors are rounding to whole grey
// levels, 0.3 of one, over a contrast of 100 and more, and the parabolas between the outline's vertices (0.01
// px).
constexpr double kQuiet_px = 0.03;

const SyntheticRig& lab() {
  static const SyntheticRig rig(lab_rig());
  return rig;
}

struct Truth {
  double range_m, bearing_rad;
};
Truth truth_of(const SyntheticLandmark& l) { return {l.centre_m.norm(), std::atan2(l.centre_m.y(), l.centre_m.x())}; }

std::vector<RangeMeasurement> look(const SyntheticRig& rig, const SyntheticScene& scene,
                                   const std::vector<Landmark>& targets, const SyntheticCamera& camera = {},
                                   std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  const auto pair = rig.take(scene, camera, random);
  return OutlineRanging(rig.rig, targets, kImage, kImage).measure(pair.lower, pair.upper);
}

/// Pixels per metre of range in the lower view, which determines the range best.
double range_px(double range_m) { return 708 * 0.53 / std::pow(range_m - 0.15 + 0.12, 2); }

void expect_near(const RangeMeasurement& m, const SyntheticLandmark& l, double most_px, const std::string& what) {
  const Truth truth = truth_of(l);
  ASSERT_TRUE(m.range_m) << what << ": " << to_string(m.verdict);
  EXPECT_LT(std::abs(*m.range_m - truth.range_m) * range_px(truth.range_m), most_px)
      << what << ": range " << *m.range_m << " m, is " << truth.range_m;
  ASSERT_TRUE(m.bearing_rad) << what << ": " << to_string(m.verdict);
  const double across_px = 708 * 0.53 / (truth.range_m - 0.03);
  EXPECT_LT(std::abs(std::remainder(*m.bearing_rad - truth.bearing_rad, 2 * std::numbers::pi)) * across_px, most_px)
      << what << ": bearing " << *m.bearing_rad << " rad, is " << truth.bearing_rad;
}

TEST(OutlineRanging, WithoutNoiseFindsEveryLandmarkToAFewHundredthsOfAPixel) {
  for (const auto& [x, y, heading] : {std::tuple{0.13, -0.21, 0.37}, {-0.61, 0.47, 2.11}, {0.83, 0.29, -1.73}}) {
    SyntheticScene scene{seen_from(six_landmarks(), {x, y}, heading), {}, {}};
    const auto measured = look(lab(), scene, targets_of(six_landmarks()));
    for (std::size_t k = 0; k < measured.size(); ++k) {
      // The tops of the nearest landmarks are beyond the lower mirror's rim.
      EXPECT_TRUE(measured[k].verdict == RangeVerdict::kOk || measured[k].verdict == RangeVerdict::kOneView)
          << to_string(measured[k].verdict) << " " << k;
      expect_near(measured[k], scene.landmarks[k], kQuiet_px, "landmark " + std::to_string(k + 1));
    }
  }
}

/// Views of cones that see the floor: both look down at low landmarks.
Rig floor_rig() {
  const auto view = [](double lens_height_m) {
    return MirrorView({.cone = {112 * std::numbers::pi / 180, 0.08, 0.08},
                       .lens_height_m = lens_height_m,
                       .centre_px = {319.5, 239.5},
                       .rim_radius_px = 236});
  };
  return {view(0.14), view(0.38)};
}

// Catches an outline along the near side of a top that is seen from above, and a top whose light moves its edge. The
// eyes of the views are 0.25 and 0.49 m high: they look down or up. A view that looks level at a top shows no range.
TEST(OutlineRanging, ViewsThatLookDownAtTopsRangeThemAsWell) {
  const SyntheticRig rig(floor_rig());
  int held = 0;
  int all = 0;
  std::uint64_t seed = 1;
  for (const auto& [top_m, light] : {std::pair{0.2, 0.7}, {0.2, 1.0}, {0.215, 0.85}, {0.28, 1.0}, {0.33, 0.7}}) {
    std::vector<SyntheticLandmark> landmarks = six_landmarks();
    for (SyntheticLandmark& l : landmarks) l.top_m = top_m;
    for (const auto& [x, y, heading] : {std::tuple{0.13, -0.21, 0.37}, {-0.31, 0.27, 2.11}}) {
      SyntheticScene scene{seen_from(landmarks, {x, y}, heading), {}, {}};
      scene.shading.top = light;
      const auto quiet = look(rig, scene, targets_of(landmarks));
      const auto noisy = look(rig, scene, targets_of(landmarks), {.noise_grey_levels = 2}, ++seed);
      for (std::size_t k = 0; k < quiet.size(); ++k) {
        SCOPED_TRACE("landmark " + std::to_string(k + 1) + ", top " + std::to_string(top_m));
        const Truth truth = truth_of(scene.landmarks[k]);
        ASSERT_EQ(quiet[k].verdict, RangeVerdict::kOk) << to_string(quiet[k].verdict);
        constexpr double kQuiet_m = 0.001;  // a tenth of a pixel at 2.5 m
        EXPECT_NEAR(*quiet[k].range_m, truth.range_m, kQuiet_m);
        ASSERT_EQ(noisy[k].verdict, RangeVerdict::kOk) << to_string(noisy[k].verdict);
        const double turn_rad = std::remainder(*noisy[k].bearing_rad - truth.bearing_rad, 2 * std::numbers::pi);
        for (const double sigmas :
             {(*noisy[k].range_m - truth.range_m) / *noisy[k].sigma_range_m, turn_rad / *noisy[k].sigma_bearing_rad}) {
          held += std::abs(sigmas) < 1.96 ? 1 : 0;
          ++all;
        }
      }
    }
  }
  // 95 % of 120 are 114; a right sigma holds fewer than 105 once in some thousand cases.
  EXPECT_GE(held, 105) << "of " << all;
}

// Catches an expected place that is not used, and one that is believed instead of the image.
TEST(OutlineRanging, LandmarksOfOneColourAreToldApartByTheirExpectedPlaces) {
  const Eigen::Vector3d red(0.6, 0.02, 0.02);
  const SyntheticScene scene{{landmark(1.9, 0.6, red, 0.1), landmark(1.7, -0.9, red, 0.1)}, {}, {}};
  std::mt19937_64 random(1);
  const auto pair = lab().take(scene, {}, random);
  const OutlineRanging ranging(lab_rig(), targets_of(scene.landmarks), kImage, kImage);
  for (const RangeMeasurement& m : ranging.measure(pair.lower, pair.upper)) {
    EXPECT_EQ(m.verdict, RangeVerdict::kSameColour);
  }
  const Eigen::Vector2d off(0.05, 0.05);
  const auto measured = ranging.measure(pair.lower, pair.upper, {},
                                        {scene.landmarks[0].centre_m + off, scene.landmarks[1].centre_m + off});
  for (std::size_t k = 0; k < 2; ++k) expect_near(measured[k], scene.landmarks[k], kQuiet_px, std::to_string(k));
  // Where it is expected, there is nothing.
  const auto elsewhere = ranging.measure(pair.lower, pair.upper, {}, {Eigen::Vector2d(-1, 1), std::nullopt});
  EXPECT_EQ(elsewhere[0].verdict, RangeVerdict::kNotSeen);
  EXPECT_EQ(elsewhere[1].verdict, RangeVerdict::kSameColour);
  EXPECT_THROW((void)ranging.measure(pair.lower, pair.upper, {}, {std::nullopt}), std::invalid_argument);
}

// Catches a width that does not follow the landmark's true radius.
TEST(OutlineRanging, TheWidthOfAnOutlineShowsTheRadius) {
  SyntheticScene scene{{landmark(1.9, 0.6, {0.6, 0.02, 0.02}, 0.1)}, {}, {}};
  std::vector<Landmark> targets = targets_of(scene.landmarks);
  targets[0].radius_m = 0.097;
  BeliefErrors errors;
  errors.landmarks.push_back(BySharedErrors<kLandmarkNumbers>::Zero(kLandmarkNumbers, 1));
  errors.landmarks[0](kRadius, 0) = 0.005;
  std::mt19937_64 random(1);
  const auto pair = lab().take(scene, {}, random);
  const auto measured = OutlineRanging(lab_rig(), targets, kImage, kImage, {}, errors).measure(pair.lower, pair.upper);
  for (const auto& sighting : {measured[0].lower_sighting, measured[0].upper_sighting}) {
    ASSERT_TRUE(sighting && sighting->width);
    EXPECT_NEAR(sighting->width->seen_px / sighting->width->expected_px, 0.1 / 0.097, 0.004);
    EXPECT_GT(sighting->width->sigma_px, 0);
  }
}

/// The landmarks as the body sees them `time_s` after the frame's time.
std::vector<SyntheticLandmark> seen_later(std::vector<SyntheticLandmark> landmarks, const BodyTwist& twist,
                                          double time_s) {
  for (SyntheticLandmark& l : landmarks) l.centre_m = place_after(l.centre_m, twist, time_s);
  return landmarks;
}

TEST(OutlineRanging, ImagesOfOtherTimesGiveThePlacesOfTheFramesTime) {
  const BodyTwist twist{0.4, 1.7};
  Rig rig = lab_rig();
  rig.exposures = {ExposureTimes{-0.012, 0}, ExposureTimes{0.009, 0}};
  const double stamped_s = 0.004;  // of the upper image after the lower one
  const SyntheticScene scene{seen_from(six_landmarks(), {0.13, -0.21}, 0.37), {}, {}};
  std::mt19937_64 random(1);
  const auto at = [&](double time_s) {
    return lab().take({seen_later(scene.landmarks, twist, time_s), {}, {}}, {}, random);
  };
  const cv::Mat lower = at(-0.012).lower;
  const cv::Mat upper = at(0.009 + stamped_s).upper;
  const auto targets = targets_of(six_landmarks());
  const OutlineRanging ranging(rig, targets, kImage, kImage);
  const auto measured = ranging.measure(lower, upper, FrameMotion{twist, stamped_s});
  for (std::size_t k = 0; k < measured.size(); ++k) {
    expect_near(measured[k], scene.landmarks[k], kQuiet_px, "landmark " + std::to_string(k + 1));
  }
  // The same places are expected of a frame that is measured landmark by landmark.
  FrameObservation observation = ranging.look(lower, upper, FrameMotion{twist, stamped_s});
  for (std::size_t k = 0; k < targets.size(); ++k) {
    const Truth truth = truth_of(scene.landmarks[k]);
    observation.expect(k, truth.range_m, truth.bearing_rad);
    observation.take(std::array{k}, Stage::kFine);
    expect_near(observation.measurements()[k], scene.landmarks[k], kQuiet_px, "expected " + std::to_string(k + 1));
  }
  EXPECT_EQ(ranging.measure(lower, upper)[0].verdict, RangeVerdict::kInconsistent) << "a body that stands";
}

/// Each of a few bands of rows is of an image of its own time.
TEST(OutlineRanging, RowsThatAreExposedOneAfterTheOtherAreMovedToTheFramesTime) {
  constexpr int kBands = 16;
  const BodyTwist twist{0, 1.7};
  const double readout_s = 0.02;
  Rig rig = lab_rig();
  rig.exposures = {ExposureTimes{0, readout_s}, ExposureTimes{0, readout_s}};
  const SyntheticScene scene{seen_from(six_landmarks(), {0.13, -0.21}, 0.37), {}, {}};
  std::mt19937_64 random(1);
  cv::Mat lower(kImage, CV_8UC3), upper(kImage, CV_8UC3);
  for (int band = 0; band < kBands; ++band) {
    const cv::Range rows(band * kImage.height / kBands, (band + 1) * kImage.height / kBands);
    const double time_s = readout_s * readout_share((rows.start + rows.end - 1) / 2.0, kImage.height);
    const auto pair = lab().take({seen_later(scene.landmarks, twist, time_s), {}, {}}, {}, random);
    pair.lower.rowRange(rows).copyTo(lower.rowRange(rows));
    pair.upper.rowRange(rows).copyTo(upper.rowRange(rows));
  }
  const auto measured =
      OutlineRanging(rig, targets_of(six_landmarks()), kImage, kImage).measure(lower, upper, FrameMotion{twist, 0});
  // Of an uncertain rig the fit finds the sides' direction itself, which the rows' times change.
  BeliefSigmas sigmas;
  sigmas.set({kTiltX, kTiltY}, 0.01);
  sigmas.set({kColumn, kRow}, 10);
  const auto uncertain =
      OutlineRanging(rig, targets_of(six_landmarks()), kImage, kImage, {}, errors_of(sigmas, six_landmarks().size()))
          .measure(lower, upper, FrameMotion{twist, 0});
  const auto global = OutlineRanging(lab_rig(), targets_of(six_landmarks()), kImage, kImage)
                          .measure(lower, upper, FrameMotion{twist, 0});
  const double most_rad = 0.03 * twist.turn_radps * readout_s;
  int wrong = 0;
  for (std::size_t k = 0; k < measured.size(); ++k) {
    const Truth truth = truth_of(scene.landmarks[k]);
    ASSERT_TRUE(measured[k].bearing_rad) << k;
    EXPECT_NEAR(*measured[k].bearing_rad, truth.bearing_rad, most_rad) << k;
    ASSERT_TRUE(uncertain[k].bearing_rad) << k;
    EXPECT_NEAR(*uncertain[k].bearing_rad, truth.bearing_rad, most_rad) << k;
    const auto& bearing_rad = global[k].bearing_rad;
    if (!bearing_rad || std::abs(*bearing_rad - truth.bearing_rad) > most_rad) ++wrong;
  }
  EXPECT_GE(wrong, 4) << "without readout_s";
}

TEST(OutlineRanging, BrightnessAndShadingOfTheScenesDoNotMoveTheEdges) {
  SyntheticScene scene{seen_from(six_landmarks(), {0.31, 0.17}, 0.71), {}, {0.3, 0.7, 0.9}};
  for (const double gain : {0.3, 0.7, 1.3}) {
    const auto measured = look(lab(), scene, targets_of(six_landmarks()), {gain, 0});
    for (std::size_t k = 0; k < measured.size(); ++k) {
      // Half a landmark is in shadow, and the shadow's edge runs across it: a tenth of a pixel.
      expect_near(measured[k], scene.landmarks[k], 0.1, "gain " + std::to_string(gain) + ", " + std::to_string(k + 1));
    }
  }
}

TEST(OutlineRanging, ChequeredBackgroundMovesEdgesByLessThanATenthOfAPixel) {
  const SyntheticRig rig(lab_rig(), {.level = 0.5, .cells = 36, .contrast = 0.5});
  SyntheticScene scene{seen_from(six_landmarks(), {-0.27, 0.33}, -0.41), {}, {}};
  const auto measured = look(rig, scene, targets_of(six_landmarks()));
  for (std::size_t k = 0; k < measured.size(); ++k) {
    expect_near(measured[k], scene.landmarks[k], 0.12, "landmark " + std::to_string(k + 1));
  }
}

TEST(OutlineRanging, ThinLandmarksAreFoundByTheirCoverage) {
  // They are 2 to 3.6 px wide at the top in the lower view and half of that in the upper one, which covers no pixel
  // wholly.
  auto posts = six_landmarks();
  for (std::size_t k = 0; k < posts.size(); ++k) posts[k].radius_m = 0.018 + 0.002 * double(k);
  SyntheticScene scene{seen_from(posts, {0.13, -0.21}, 0.37), {}, {}};
  const auto measured = look(lab(), scene, targets_of(posts), {1, 1.0});
  int found = 0;
  for (std::size_t k = 0; k < measured.size(); ++k) {
    const RangeMeasurement& m = measured[k];
    if (!m.range_m) continue;
    ++found;
    const Truth truth = truth_of(scene.landmarks[k]);
    // The edge is two pixels long, and the noise is a hundredth of its contrast.
    EXPECT_LT(std::abs(*m.range_m - truth.range_m), 5 * *m.sigma_range_m + 0.003) << k << to_string(m.verdict);
    EXPECT_LT(*m.sigma_range_m, 0.02) << k;
    if (!m.bearing_rad) continue;
    const double off = std::remainder(*m.bearing_rad - truth.bearing_rad, 2 * std::numbers::pi);
    EXPECT_LT(std::abs(off), 5 * *m.sigma_bearing_rad + 1e-4) << k << to_string(m.verdict);
  }
  EXPECT_GE(found, 4) << "of six";
}

/// The image that a camera out of focus takes of that light.
cv::Mat out_of_focus(const cv::Mat& rgb, double defocus_px) {
  cv::Mat light;
  cv::LUT(rgb, cv::Mat(light_of_code()), light);
  return image_quality_test::taken(light, {.defocus_px = defocus_px}, 1);
}

// A rim that is out of focus seems to lie farther inside its bend, 1 to 2 mm of range here, and the middle of a thin
// landmark is a mixture with what is beside it. Catches a bend that counts for sharp pixels only, and a mixture that is
// taken for the landmark's colour, which makes it a third of a pixel too wide.
TEST(OutlineRanging, DefocusMovesNoEdge) {
  for (const auto& [defocus_px, radius_m] :
       {std::pair{1.2, 0.06}, {1.2, 0.08}, {1.2, 0.12}, {1.2, 0.15}, {2.0, 0.08}, {2.0, 0.12}}) {
    auto posts = six_landmarks();
    for (auto& post : posts) post.radius_m = radius_m;
    const SyntheticScene scene{seen_from(posts, {0.13, -0.21}, 0.37), {}, {}};
    std::mt19937_64 random(1);
    const auto pair = lab().take(scene, {}, random);
    const auto measured = OutlineRanging(lab().rig, targets_of(posts), kImage, kImage)
                              .measure(out_of_focus(pair.lower, defocus_px), out_of_focus(pair.upper, defocus_px));
    double off_m = 0;
    double too_wide_px = 0;
    int found = 0;
    for (std::size_t k = 0; k < measured.size(); ++k) {
      if (!measured[k].range_m) continue;
      off_m += *measured[k].range_m - truth_of(scene.landmarks[k]).range_m;
      const auto& width = measured[k].lower_sighting->width;
      too_wide_px += width->seen_px - width->expected_px;
      ++found;
    }
    const std::string what = "radius " + std::to_string(radius_m) + " m, defocus " + std::to_string(defocus_px) + " px";
    EXPECT_GE(found, 4) << what;
    EXPECT_LT(std::abs(off_m / found), 0.6e-3) << what;
    EXPECT_LT(std::abs(too_wide_px / found), 0.05 * defocus_px) << what;
  }
}

// Catches an invented range where the top is a single pixel.
TEST(OutlineRanging, OfLandmarksThinnerThanAPixelNoRangeIsInvented) {
  auto posts = six_landmarks();
  for (auto& post : posts) post.radius_m = 0.004;  // 0.5 px
  SyntheticScene scene{seen_from(posts, {0.13, -0.21}, 0.37), {}, {}};
  const auto measured = look(lab(), scene, targets_of(posts), {1, 1.0});
  for (std::size_t k = 0; k < measured.size(); ++k) {
    if (!measured[k].range_m) continue;
    EXPECT_LT(std::abs(*measured[k].range_m - truth_of(scene.landmarks[k]).range_m), 5 * *measured[k].sigma_range_m)
        << k << to_string(measured[k].verdict);
  }
}

TEST(OutlineRanging, AMirroredTurnedTiltedRigIsNoDifferent) {
  Rig rig = lab_rig();
  MirrorViewSettings lower = rig.lower.settings();
  lower.mirrored = true;
  lower.azimuth_rad = 0.83;
  lower.tilt_rad = {0.009, -0.006};
  MirrorViewSettings upper = rig.upper.settings();
  upper.centre_px = {316.2, 243.9};
  upper.axis_offset_m = {0.004, -0.003};
  const SyntheticRig skewed(Rig{MirrorView(lower), MirrorView(upper)});
  SyntheticScene scene{seen_from(six_landmarks(), {0.13, -0.21}, 0.37), {}, {}};
  const auto measured = look(skewed, scene, targets_of(six_landmarks()));
  for (std::size_t k = 0; k < measured.size(); ++k) {
    expect_near(measured[k], scene.landmarks[k], 2 * kQuiet_px, "landmark " + std::to_string(k + 1));
  }
}

/// Two mirrors that are tilted as far as a careless builder leaves them, behind a lens whose axis is beside the tip.
Rig leaning_rig() {
  Rig rig = lab_rig();
  for (MirrorView* view : {&rig.lower, &rig.upper}) {
    MirrorViewSettings s = view->settings();
    s.tilt_rad = view == &rig.lower ? Eigen::Vector2d(-0.023, -0.028) : Eigen::Vector2d(0.034, -0.033);
    s.centre_px = {318.4, 227.8};
    s.distortion = {.coefficients = {-0.05, 0.03, 0, 0}, .focal_px = {600, 600}, .principal_px = {319.5, 239.5}};
    *view = MirrorView(s);
  }
  return rig;
}

/// Returns the greatest distance from `sighted` near points to those of the truth, of tops beyond 60 px from the tip:
/// nearer, a top's curvature within a pixel is an error of its own. @param rig the true one
double farthest_px(const std::vector<RangeMeasurement>& sighted, const Rig& rig, const SyntheticScene& scene) {
  double most_px = 0;
  int count = 0;
  for (std::size_t k = 0; k < sighted.size(); ++k) {
    const SyntheticLandmark& l = scene.landmarks[k];
    for (const auto& [view, sighting] :
         {std::pair{&rig.lower, &sighted[k].lower_sighting}, std::pair{&rig.upper, &sighted[k].upper_sighting}}) {
      const auto near_m = near_top_point(*view, l.centre_m, l.radius_m, l.top_m);
      const auto near_px = near_m ? view->project(*near_m) : std::nullopt;
      if (!near_px || !*sighting || (*near_px - view->settings().centre_px).norm() < 60) continue;
      most_px = std::max(most_px, ((*sighting)->pixel_px - *near_px).norm());
      ++count;
    }
  }
  EXPECT_GE(count, 6);
  return most_px;
}

/// The sides of a landmark are straight in space. Behind a tilted mirror or a lens they are curves.
TEST(OutlineRanging, SidesThatAMirrorOrALensBendsDoNotMoveTheTop) {
  const SyntheticRig rig(leaning_rig());
  for (const auto& [x, y, heading] : {std::tuple{0.13, -0.21, 0.37}, {-0.61, 0.47, 2.11}, {0.83, 0.29, -1.73}}) {
    SyntheticScene scene{seen_from(six_landmarks(), {x, y}, heading), {}, {}};
    scene.shading.diffuse = 0;
    EXPECT_LT(farthest_px(look(rig, scene, targets_of(six_landmarks())), rig.rig, scene), 0.012);
  }
}

/// The same rig, of which the robot believes something else, but states how far it may be off.
TEST(OutlineRanging, ABelievedRigThatIsWrongHardlyMovesTheTop) {
  const SyntheticRig rig(leaning_rig());
  BeliefSigmas sigmas;
  sigmas.set({kTiltX, kTiltY}, 0.01);
  sigmas.set({kColumn, kRow}, 10);
  sigmas.set({kApex}, 0.004);
  sigmas.set({kLensToTip}, 0.002);
  Eigen::VectorXd wrong = Eigen::VectorXd::Zero(kRigNumbers);
  for (const Side side : {Side::kLower, Side::kUpper}) {
    wrong[rig_number(side, kTiltX)] = 0.004;
    wrong[rig_number(side, kTiltY)] = -0.003;
    wrong[rig_number(side, kColumn)] = 0.4;
    wrong[rig_number(side, kRow)] = -0.3;
    wrong[rig_number(side, kLensToTip)] = 0.002;
  }
  SyntheticScene scene{seen_from(six_landmarks(), {0.13, -0.21}, 0.37), {}, {}};
  scene.shading.diffuse = 0;
  const auto targets = targets_of(six_landmarks());
  std::mt19937_64 random(1);
  const auto pair = rig.take(scene, {}, random);
  const auto off_px = [&](const BeliefErrors& errors) {
    const OutlineRanging ranging(with_errors(rig.rig, wrong), targets, kImage, kImage, {}, errors);
    return farthest_px(ranging.measure(pair.lower, pair.upper), rig.rig, scene);
  };
  const double as_exact_px = off_px({});
  EXPECT_GT(as_exact_px, 0.1);
  EXPECT_LT(off_px(errors_of(sigmas, targets.size())), as_exact_px / 4);
}

// Catches tops that are found at the believed rig's horizon and not where the image shows them. The lower view's eye is
// 0.25 m high, and hardly looks up at them.
TEST(OutlineRanging, ABelievedTiltDoesNotMoveTopsAtTheHorizon) {
  const SyntheticRig rig(floor_rig());
  std::vector<SyntheticLandmark> landmarks = six_landmarks();
  for (SyntheticLandmark& l : landmarks) l.top_m = 0.3;
  SyntheticScene scene{seen_from(landmarks, {0.13, -0.21}, 0.37), {}, {}};
  scene.shading.diffuse = 0;
  const auto targets = targets_of(landmarks);
  BeliefSigmas sigmas;
  sigmas.set({kTiltX, kTiltY}, 0.01);
  Eigen::VectorXd wrong = Eigen::VectorXd::Zero(kRigNumbers);
  wrong[rig_number(Side::kLower, kTiltX)] = 0.006;
  wrong[rig_number(Side::kLower, kTiltY)] = -0.006;
  std::mt19937_64 random(1);
  const auto pair = rig.take(scene, {}, random);
  const auto off_px = [&](const BeliefErrors& errors) {
    const OutlineRanging ranging(with_errors(rig.rig, wrong), targets, kImage, kImage, {}, errors);
    return farthest_px(ranging.measure(pair.lower, pair.upper), rig.rig, scene);
  };
  EXPECT_GT(off_px({}), 1);
  EXPECT_LT(off_px(errors_of(sigmas, targets.size())), 0.1);
}

TEST(OutlineRanging, TooNearForTheLowerMirrorLeavesTheUpperOneAndThenNone) {
  auto landmarks = six_landmarks();
  SyntheticScene scene{seen_from(landmarks, {1.37, 0.52}, 0.2), {}, {}};  // 1.1 m from the cyan one
  auto measured = look(lab(), scene, targets_of(landmarks));
  EXPECT_EQ(measured[3].verdict, RangeVerdict::kOneView) << to_string(measured[3].verdict);
  EXPECT_FALSE(measured[3].lower_sighting);
  ASSERT_TRUE(measured[3].range_m);
  EXPECT_NEAR(*measured[3].range_m, truth_of(scene.landmarks[3]).range_m, 0.001);

  scene.landmarks = seen_from(landmarks, {1.75, 0.41}, 0.2);  // 0.71 m: above both rims
  measured = look(lab(), scene, targets_of(landmarks));
  EXPECT_EQ(measured[3].verdict, RangeVerdict::kTruncated) << to_string(measured[3].verdict);
  EXPECT_FALSE(measured[3].range_m);
}

/// Sweeps a mast of that half width across the red landmark, in steps.
void sweep_mast(const Eigen::Vector2d& from_m, double half_width_m, double step_rad) {
  const auto landmarks = six_landmarks();
  for (int step = -8; step <= 8; ++step) {
    SyntheticScene scene{seen_from(landmarks, from_m, 0.37), {}, {}};
    const Truth truth = truth_of(scene.landmarks[0]);
    scene.strips.push_back({truth.bearing_rad + step * step_rad, 0.13, half_width_m, {0.2, 0.2, 0.2}});
    const auto m = look(lab(), scene, targets_of(landmarks), {1, 1}).front();
    if (m.bearing_rad) {
      const double off = std::remainder(*m.bearing_rad - truth.bearing_rad, 2 * std::numbers::pi);
      EXPECT_LT(std::abs(off), 5 * *m.sigma_bearing_rad + 2e-4)
          << truth.range_m << " m, step " << step << " " << to_string(m.verdict);
    }
    if (m.range_m) {
      EXPECT_LT(std::abs(*m.range_m - truth.range_m), 5 * *m.sigma_range_m + 1e-3)
          << truth.range_m << " m, step " << step << " " << to_string(m.verdict);
    }
  }
}

TEST(OutlineRanging, AMastBeforeALandmarkIsNeverQuietlyWrong) {
  // The mast is 3.5 degrees wide and stands in front of a landmark that is 7 degrees wide.
  sweep_mast({0.13, -0.21}, 0.004, 0.011);
}

TEST(OutlineRanging, NorIsAMastBeforeAFarOneThatTheUpperViewShowsAsALine) {
  // With TWOCONE_CASES, each mast at each place (evidence.sh accuracy).
  const bool all = std::getenv("TWOCONE_CASES") != nullptr;
  const std::array<Eigen::Vector2d, 3> places_m{{{1.2, 1.0}, {1.3, 1.6}, {2.2, 1.9}}};
  constexpr std::array kHalfWidths_m{0.002, 0.004, 0.006};
  for (std::size_t place = 0; place < 3; ++place) {
    for (std::size_t mast = 0; mast < 3; ++mast) {
      if (all || place == mast) sweep_mast(places_m[place], kHalfWidths_m[mast], 0.006);
    }
  }
}

TEST(OutlineRanging, TwoLandmarksOfOneColourAreFlaggedAndNeverTheNearerByLuck) {
  auto landmarks = six_landmarks();
  landmarks[3].colour = landmarks[0].colour;
  SyntheticScene scene{seen_from(landmarks, {0.13, -0.21}, 0.37), {}, {}};
  auto measured = look(lab(), scene, targets_of(landmarks));
  EXPECT_EQ(measured[0].verdict, RangeVerdict::kSameColour);
  EXPECT_EQ(measured[3].verdict, RangeVerdict::kSameColour);
  EXPECT_FALSE(measured[0].range_m || measured[3].range_m);

  // One of the two is not in the map.
  auto targets = targets_of(six_landmarks());
  measured = look(lab(), scene, targets);
  EXPECT_EQ(measured[0].verdict, RangeVerdict::kTwoCandidates) << to_string(measured[0].verdict);
  EXPECT_FALSE(measured[0].range_m);
}

/// Every place in this room is nearer to every landmark.
constexpr double kRoom_m = 6;
std::vector<Landmark> targets_of_room() {
  auto targets = targets_of(six_landmarks());
  for (Landmark& target : targets) target.greatest_range_m = kRoom_m;
  return targets;
}

// Catches taking a nearer object for the landmark because it is larger in the image.
TEST(OutlineRanging, ANearerThingOfALandmarksColourIsNotTakenForIt) {
  const auto targets = targets_of_room();
  const double bearings[] = {0.4, 1.3, 2.2, 3.05, 3.7, 4.6, 5.5};
  for (const double distance_m : {0.83, 1.21, 1.67}) {
    for (const double bearing_rad : bearings) {
      SyntheticScene scene{seen_from(six_landmarks(), {0.37, -0.21}, 0.37), {}, {}};
      const Truth truth = truth_of(scene.landmarks[0]);
      const double off = std::abs(std::remainder(bearing_rad - truth.bearing_rad, 2 * std::numbers::pi));
      // A landmark behind the object, or nearly behind it, cannot be seen.
      if (off < std::asin(0.15 / distance_m)) continue;
      scene.landmarks.push_back(
          landmark(distance_m * std::cos(bearing_rad), distance_m * std::sin(bearing_rad), six_landmarks()[0].colour));
      const auto m = look(lab(), scene, targets, {1, 1}).front();
      EXPECT_EQ(m.verdict, RangeVerdict::kTwoCandidates)
          << distance_m << " m, " << off << " rad from the landmark: " << to_string(m.verdict);
      EXPECT_FALSE(m.range_m) << distance_m << " m: " << *m.range_m << ", is " << truth.range_m;
    }
  }
}

TEST(OutlineRanging, ARivalIsAsLargeAsHalfTheLandmarkAtTheRoomsEnd) {
  const auto targets = targets_of_room();
  // The wedge is asin(0.15 / 6) wide to either side and extends from 16 px to 708 0.53 / (6 - 0.15 + 0.12) px.
  const double top_px = 708 * 0.53 / (kRoom_m - 0.15 + 0.12);
  const double half_px = 0.5 * std::asin(0.15 / kRoom_m) * (top_px * top_px - 16 * 16);
  std::mt19937_64 random(1);
  const SyntheticScene scene{seen_from(six_landmarks(), {0.13, -0.21}, 0.37), {}, {}};
  const auto pair = lab().take(scene, {1, 1}, random);
  const OutlineRanging ranging(lab().rig, targets, kImage, kImage);
  // The side is even, since the finder tests every other pixel first.
  for (const int side_px : {2, 4, 6, 8, 10, 20}) {
    auto lower = pair.lower.clone();
    lower(cv::Rect(400, 300, side_px, side_px)).setTo(cv::Scalar(200, 8, 8));
    const auto m = ranging.measure(lower, pair.upper).front();
    const bool is_rival = side_px * side_px >= half_px;
    EXPECT_EQ(m.verdict, is_rival ? RangeVerdict::kTwoCandidates : RangeVerdict::kOk)
        << side_px * side_px << " px of " << half_px << ": " << to_string(m.verdict);
  }
}

// Catches adding up single pixels that noise gives a landmark's hue. In a dark room, noise of 4 grey levels gives some
// per cent of the pixels each hue.
TEST(OutlineRanging, NoiseIsNoRival) {
  const auto targets = targets_of_room();
  const SyntheticRig dark(lab_rig(), {.level = 0.006});
  const SyntheticScene scene{seen_from(six_landmarks(), {0.13, -0.21}, 0.37), {}, {}};
  std::mt19937_64 random(1);
  int rivals = 0;
  for (int frame = 0; frame < 3; ++frame) {
    const auto pair = dark.take(scene, {1, 4.0}, random);
    const OutlineRanging ranging(dark.rig, targets, kImage, kImage);
    for (const auto& m : ranging.measure(pair.lower, pair.upper)) {
      rivals += m.verdict == RangeVerdict::kTwoCandidates ? 1 : 0;
    }
  }
  EXPECT_LE(rivals, 1);
}

// Catches taking the halves of one landmark for two landmarks.
TEST(OutlineRanging, ALandmarkInHalvesIsOneLandmark) {
  const auto landmarks = six_landmarks();
  const auto targets = targets_of_room();
  int ranges = 0;
  for (const double half_width_m : {0.004, 0.008}) {  // 3.5 and 7 degrees in front of a landmark of 10 degrees
    for (const double off_rad : {-0.02, 0.0, 0.013}) {
      SyntheticScene scene{seen_from(landmarks, {-0.8, -0.35}, 0.37), {}, {}};
      const Truth truth = truth_of(scene.landmarks[0]);
      scene.strips.push_back({truth.bearing_rad + off_rad, 0.13, half_width_m, {0.2, 0.2, 0.2}});
      const auto m = look(lab(), scene, targets, {1, 1}).front();
      EXPECT_NE(m.verdict, RangeVerdict::kTwoCandidates) << half_width_m << " m, " << off_rad << " rad";
      if (!m.range_m) continue;
      ++ranges;
      EXPECT_LT(std::abs(*m.range_m - truth.range_m), 5 * *m.sigma_range_m + 1e-3) << to_string(m.verdict);
    }
  }
  EXPECT_GE(ranges, 1);
}

// Catches taking a top at another height than in the map for a top that a view does not show.
TEST(OutlineRanging, ATopThatContradictsTheMapIsInconsistentHoweverMuch) {
  const auto targets = targets_of_room();
  for (const double lower_by_m : {-0.10, -0.05, 0.02, 0.05, 0.07, 0.10, 0.15}) {
    auto landmarks = six_landmarks();
    for (SyntheticLandmark& p : landmarks) p.top_m -= lower_by_m;
    for (const auto& [x, y, heading] : {std::tuple{0.13, -0.21, 0.37}, {0.31, 0.17, 2.11}}) {
      SyntheticScene scene{seen_from(landmarks, {x, y}, heading), {}, {}};
      const auto measured = look(lab(), scene, targets, {1, 1});
      for (std::size_t k = 0; k < measured.size(); ++k) {
        EXPECT_EQ(measured[k].verdict, RangeVerdict::kInconsistent)
            << lower_by_m << " m lower, landmark " << k + 1 << ": " << to_string(measured[k].verdict);
        EXPECT_FALSE(measured[k].range_m || measured[k].bearing_rad) << lower_by_m << " m lower, landmark " << k + 1;
      }
    }
  }
}

// Checks the building guide's table of troubles.
TEST(OutlineRanging, ExchangedAndTurnedCamerasAreSeenByTheirVerdicts) {
  const auto targets = targets_of_room();
  std::mt19937_64 random(1);
  const auto pair = lab().take({seen_from(six_landmarks(), {0.13, -0.21}, 0.37), {}, {}}, {1, 1}, random);
  const OutlineRanging ranging(lab().rig, targets, kImage, kImage);
  const auto flipped = [](const cv::Mat& image, int code) {
    cv::Mat result;
    cv::flip(image, result, code);
    return result;
  };
  for (const RangeMeasurement& m : ranging.measure(pair.upper, pair.lower)) {
    EXPECT_FALSE(m.range_m) << "exchanged: " << to_string(m.verdict);
  }
  for (const int code : {0, 1, -1}) {
    for (const auto& measured : {ranging.measure(flipped(pair.lower, code), pair.upper),
                                 ranging.measure(pair.lower, flipped(pair.upper, code))}) {
      for (const RangeMeasurement& m : measured) EXPECT_EQ(m.verdict, RangeVerdict::kTwoCandidates) << "flip " << code;
    }
  }
  for (const RangeMeasurement& m : ranging.measure(flipped(pair.lower, 1), flipped(pair.upper, 1))) {
    EXPECT_TRUE(m.range_m) << "both mirrored: " << to_string(m.verdict);
  }
}

TEST(OutlineRanging, SaturatedLandmarksAreFlaggedOrLeftOut) {
  SyntheticScene scene{seen_from(six_landmarks(), {0.13, -0.21}, 0.37), {}, {}};
  const auto measured = look(lab(), scene, targets_of(six_landmarks()), {60, 0});
  for (const RangeMeasurement& m : measured) {
    EXPECT_TRUE(m.verdict == RangeVerdict::kSaturated || m.verdict == RangeVerdict::kNotSeen ||
                m.verdict == RangeVerdict::kNoMatch)
        << to_string(m.verdict);
    EXPECT_FALSE(m.range_m);
  }
}

TEST(OutlineRanging, AnEmptyRoomABlackImageAndNoiseAloneShowNothing) {
  const auto targets = targets_of(six_landmarks());
  for (const SyntheticCamera& camera : {SyntheticCamera{1, 0}, {0, 0}, {1, 3}}) {
    for (const RangeMeasurement& m : look(lab(), {}, targets, camera)) {
      EXPECT_EQ(m.verdict, RangeVerdict::kNotSeen) << to_string(m.verdict);
      EXPECT_FALSE(m.range_m || m.bearing_rad || m.lower_sighting || m.upper_sighting);
    }
  }
}

TEST(OutlineRanging, TheAnswerIsAFunctionOfTheImagesAlone) {
  std::mt19937_64 random(5);
  const auto targets = targets_of(six_landmarks());
  const OutlineRanging ranging(lab().rig, targets, kImage, kImage);
  const SyntheticScene here{seen_from(six_landmarks(), {0.13, -0.21}, 0.37), {}, {}};
  const SyntheticScene there{seen_from(six_landmarks(), {-0.61, 0.47}, 2.11), {}, {}};
  const auto first = lab().take(here, {1, 2}, random);
  const auto second = lab().take(there, {1, 2}, random);
  const auto cold = ranging.measure(first.lower, first.upper);
  (void)ranging.measure(second.lower, second.upper);
  const auto warm = ranging.measure(first.lower, first.upper);
  for (std::size_t k = 0; k < cold.size(); ++k) {
    ASSERT_TRUE(cold[k].range_m && warm[k].range_m);
    EXPECT_EQ(*cold[k].range_m, *warm[k].range_m);
    EXPECT_EQ(*cold[k].bearing_rad, *warm[k].bearing_rad);
  }
}

TEST(OutlineRanging, RefusesImagesAndTargetsThatItCannotUse) {
  const auto targets = targets_of(six_landmarks());
  const OutlineRanging ranging(lab().rig, targets, kImage, kImage);
  const cv::Mat right(kImage, CV_8UC3, cv::Scalar::all(0));
  EXPECT_THROW((void)ranging.measure(cv::Mat(kImage, CV_8UC1), right), std::invalid_argument);
  EXPECT_THROW((void)ranging.measure(right, cv::Mat(100, 100, CV_8UC3)), std::invalid_argument);
  auto bad = targets;
  bad[2].radius_m = 0;
  EXPECT_THROW(OutlineRanging(lab().rig, bad, kImage, kImage), std::invalid_argument);
  bad = targets;
  bad[2].top_m = std::nan("");
  EXPECT_THROW(OutlineRanging(lab().rig, bad, kImage, kImage), std::invalid_argument);
  bad = targets;
  bad[2].greatest_range_m = bad[2].radius_m;
  EXPECT_THROW(OutlineRanging(lab().rig, bad, kImage, kImage), std::invalid_argument);
  for (const cv::Size& size : {cv::Size(-4, 480), cv::Size(640, -4), cv::Size(0, 480)}) {
    EXPECT_THROW(OutlineRanging(lab().rig, targets, size, kImage), std::invalid_argument) << size;
    EXPECT_THROW(OutlineRanging(lab().rig, targets, kImage, size), std::invalid_argument) << size;
  }
  bad = targets;
  bad[2].colour = {0.5, 0.5, 0.5};
  EXPECT_THROW(OutlineRanging(lab().rig, bad, kImage, kImage), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <map>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "tests/support/error_of.h"
#include "tests/vision/drive_among_landmarks.h"
#include "vision/calibration.h"

namespace twocone::vision {
namespace {

/// Half a loop, with all of its changes of speed.
constexpr double kShortDrive_s = 14;

bool shows() { return std::getenv("TWOCONE_SHOW") != nullptr; }

/// Gives each landmark's place this standard deviation.
void doubt(CalibrationProblem& problem, double sigma_m) {
  for (Landmark& landmark : problem.landmarks) landmark.sigma.x_m = landmark.sigma.y_m = sigma_m;
}

CalibrationProblem timed_problem(DriveSettings world) {
  world.gives_twists = true;
  CalibrationProblem problem{
      lab_rig(), WheelBelief{0.05, 0.30}, DriveSettings{}.landmarks, drive_among_landmarks(world), {}, {}};
  problem.systematic_px = 0;  // this world has no systematic error
  problem.fit_timing = true;
  problem.height_px = {kDriveHeight_px, kDriveHeight_px};
  return problem;
}

std::map<std::string, double> times_of(const DriveSettings& world) {
  return {{"latency_s", world.latency_s},
          {"upper.skew_s", world.upper_skew_s},
          {"lower.readout_s", world.readout_s[0]},
          {"upper.readout_s", world.readout_s[1]}};
}

void expect_times(const CalibrationResult& result, const DriveSettings& world) {
  ASSERT_EQ(result.verdict, CalibrationVerdict::kOk) << to_string(result.verdict);
  for (const auto& [name, truth] : times_of(world)) {
    const CalibratedParameter& p = parameter(result, name);
    EXPECT_TRUE(p.observed) << name << " sigma " << p.sigma;
    EXPECT_LE(std::abs(p.after - truth), kCalibrationSigmas * p.sigma)
        << name << " " << p.after << " +- " << p.sigma << " s";
    if (shows())
      fmt::print("{:16} {:7.2f} ms +- {:5.2f}, true {:5.1f}\n", name, p.after * 1e3, p.sigma * 1e3, truth * 1e3);
  }
}

DriveSettings with_rig_errors(DriveSettings world) {
  MirrorViewSettings lower = lab_view(0.25);
  MirrorViewSettings upper = lab_view(0.55);
  lower.centre_px += Eigen::Vector2d(2.1, -2.2);
  upper.tilt_rad = {-0.4 * kDegree * 0.8, -0.4 * kDegree * 0.6};
  world.rig = {MirrorView(lower), MirrorView(upper)};
  world.left_wheel_m = world.right_wheel_m = 0.0505;
  return world;
}

/// Each time alone in a drive of a quarter of a minute; all of them, with a wrong rig too, in one of half a minute.
TEST(CalibrationTiming, FindsEachPlantedTimeAndInventsNone) {
  struct Planted {
    const char* name;
    DriveSettings world;
    std::map<std::string, double> most_ms;  ///< greatest sigma: a seventh of the value planted here
  };
  const DriveSettings skew{.duration_s = kShortDrive_s, .upper_skew_s = 0.008};
  const DriveSettings readout{.duration_s = kShortDrive_s, .readout_s = {0.015, 0.015}};
  const DriveSettings latency{.duration_s = kShortDrive_s, .latency_s = 0.025};
  const DriveSettings all{.latency_s = 0.025, .upper_skew_s = 0.008, .readout_s = {0.015, 0.015}};
  for (const Planted& planted :
       {Planted{"skew", skew, {{"upper.skew_s", 0.8}}},
        Planted{"readout", readout, {{"lower.readout_s", 1.5}, {"upper.readout_s", 2.2}}},
        Planted{"latency", latency, {{"latency_s", 3}}},
        Planted{"all, and the rig",
                with_rig_errors(all),
                {{"upper.skew_s", 0.8}, {"lower.readout_s", 1.5}, {"upper.readout_s", 1.5}, {"latency_s", 2.5}}}}) {
    SCOPED_TRACE(planted.name);
    if (shows()) fmt::print("planted: {}\n", planted.name);
    const CalibrationResult result = calibrate(timed_problem(planted.world));
    expect_times(result, planted.world);
    for (const auto& [name, most_ms] : planted.most_ms) EXPECT_LE(parameter(result, name).sigma * 1e3, most_ms) << name;
  }
}

TEST(CalibrationTiming, FindsNothingWhereNothingIsOverTwentySeeds) {
  constexpr int kSeeds = 20;
  // Quantiles 1e-4 and 1 - 1e-4 of the mean of 20 and of 80 squares of a Gaussian: chi-squared over its degrees.
  constexpr std::array<double, 2> kOfOne{0.220, 2.62};
  constexpr std::array<double, 2> kOfAll{0.516, 1.70};
  std::map<std::string, double> squares;
  double joint = 0;  // for all four times at once: the covariance must be true off the diagonal too
  double most = 0;   // of the landmarks' chi-squared
  double landmarks = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const DriveSettings world{.duration_s = kShortDrive_s, .every_s = 0.6, .seed = std::uint64_t(seed)};
    CalibrationProblem problem = timed_problem(world);
    doubt(problem, 0.005);
    const CalibrationResult result = calibrate(problem);
    ASSERT_EQ(result.verdict, CalibrationVerdict::kOk) << seed;
    std::vector<Eigen::Index> where;
    Eigen::Vector4d off;
    for (const auto& [name, truth] : times_of(world)) {
      const CalibratedParameter& p = parameter(result, name);
      off[Eigen::Index(where.size())] = p.after - truth;
      where.push_back(Eigen::Index(index_of(result, name)));
      squares[name] += std::pow((p.after - truth) / p.sigma, 2) / kSeeds;
    }
    joint += off.dot(Eigen::Matrix4d(result.covariance(where, where)).ldlt().solve(off)) / (4 * kSeeds);
    for (const RelativeShift& s : shifts_among(result, problem.landmarks, 1e9)) {
      most = std::max(most, s.chi_squared);
      landmarks += s.chi_squared / (2.0 * kSeeds * double(problem.landmarks.size()));
    }
  }
  for (const auto& [name, square] : squares) {
    if (shows()) fmt::print("{:16} {:.2f}\n", name, square);
    EXPECT_GT(square, kOfOne[0]) << name;
    EXPECT_LT(square, kOfOne[1]) << name;
  }
  if (shows()) fmt::print("joint {:.2f}, landmarks {:.2f}, at most {:.1f}\n", joint, landmarks, most);
  EXPECT_GT(joint, kOfAll[0]);
  EXPECT_LT(joint, kOfAll[1]);
  // 120 times exp(-x / 2) is 1e-3.
  EXPECT_LT(most, 23.4);
}

TEST(CalibrationTiming, NamesParametersThatStandingStillDoesNotDetermine) {
  const DriveSettings world{.duration_s = 8, .still = true};
  const CalibrationResult result = calibrate(timed_problem(world));
  ASSERT_EQ(result.verdict, CalibrationVerdict::kOk);
  for (const auto& [name, truth] : times_of(world)) {
    const CalibratedParameter& p = parameter(result, name);
    EXPECT_FALSE(p.observed) << name << " sigma " << p.sigma;
    EXPECT_EQ(p.after, 0) << name;
    EXPECT_DOUBLE_EQ(p.sigma, p.prior_sigma) << name;
    const auto at = Eigen::Index(index_of(result, name));
    EXPECT_NEAR(result.covariance(at, at), p.prior_sigma * p.prior_sigma, 1e-12) << name;
  }
}

TEST(CalibrationTiming, AsksOnlyForWhatThereIs) {
  const DriveSettings world{.duration_s = 8};
  const auto names = [](const CalibrationProblem& problem) {
    std::vector<std::string> all;
    for (const CalibratedParameter& p : calibrate(problem).parameters) {
      if (p.name.ends_with("_s")) all.push_back(p.name);
    }
    return all;
  };
  CalibrationProblem problem = timed_problem(world);
  problem.height_px[1] = 0;
  EXPECT_THAT(names(problem), testing::ElementsAre("latency_s", "upper.skew_s", "lower.readout_s"));
  problem.wheels.reset();
  EXPECT_THAT(names(problem), testing::ElementsAre("upper.skew_s", "lower.readout_s"));
  for (CalibrationFrame& frame : problem.frames) frame.twist.reset();
  EXPECT_THAT(names(problem), testing::IsEmpty());
  problem = timed_problem(world);
  problem.fit_timing = false;
  EXPECT_THAT(names(problem), testing::IsEmpty());
}

/// A stamp is not skew: with it the views agree as if they were taken at the same time; without it skew is missing.
TEST(CalibrationTiming, TakesStampsAtTheirWord) {
  const DriveSettings world{.duration_s = kShortDrive_s, .upper_late_s = 0.02};
  CalibrationProblem problem = timed_problem(world);
  expect_times(calibrate(problem), world);
  problem.fit_timing = false;
  // 36 frames have 21 numbers each beyond the pose: 3 sigmas of 1 / sqrt(2 * 36 * 21).
  EXPECT_NEAR(calibrate(problem).sighting_scale, 1, 0.08);
  for (CalibrationFrame& frame : problem.frames) {
    for (LandmarkSighting& s : frame.sightings) s.late_s = 0;
  }
  EXPECT_GT(calibrate(problem).sighting_scale, 1.3) << "azimuth and offset take a part";
  problem.fit_timing = true;
  const CalibratedParameter skew = parameter(calibrate(problem), "upper.skew_s");
  EXPECT_NEAR(skew.after, world.upper_late_s, kCalibrationSigmas * skew.sigma);
}

/// Twists are computed with believed wheels. If these are half as large again as the true ones, every time would come
/// out a third too short.
TEST(CalibrationTiming, IsRightUnderWheelsOfAnotherSize) {
  const DriveSettings world{
      .left_wheel_m = 0.075, .right_wheel_m = 0.075, .duration_s = kShortDrive_s, .upper_skew_s = 0.03};
  CalibrationProblem problem = timed_problem(world);
  problem.priors.wheel_radius_share = 0.3;
  expect_times(calibrate(problem), world);
}

/// Motions to and from a frame without a twist give no information: used without the latency, they would bias it to 0.
TEST(CalibrationTiming, LeavesOutWaysWithoutTwist) {
  const DriveSettings world{.latency_s = 0.025};
  CalibrationProblem problem = timed_problem(world);
  for (std::size_t i = 0; i < problem.frames.size(); i += 5) problem.frames[i].twist.reset();
  expect_times(calibrate(problem), world);
}

TEST(CalibrationTiming, GivesPosesOfTheImages) {
  const DriveSettings world{.duration_s = kShortDrive_s, .latency_s = 0.025};
  CalibrationProblem problem = timed_problem(world);
  problem.frames[20].sightings.clear();
  const CalibrationResult result = calibrate(problem);
  ASSERT_EQ(result.poses.size(), problem.frames.size());
  EXPECT_FALSE(result.poses[20]);
  // A sighting is accurate to 0.1 px at some 150 px from the tip at 2 m, which is 1.3 mm; a pose from twelve of them is
  // accurate to half of that in each axis. The motion during the latency is some 10 mm.
  constexpr double kMost_m = 0.004;
  for (std::size_t i = 0; i < result.poses.size(); ++i) {
    if (i == 20) continue;
    const Eigen::Vector3d truth = pose_on_loop(double(i) * world.every_s - world.latency_s);
    ASSERT_TRUE(result.poses[i]) << i;
    EXPECT_LT((result.poses[i]->head<2>() - truth.head<2>()).norm(), kMost_m) << i;
  }
}

TEST(CalibrationTiming, CovarianceIsJoint) {
  const DriveSettings world = with_rig_errors({.duration_s = 8});
  const CalibrationResult result = calibrate(timed_problem(world));
  ASSERT_EQ(result.verdict, CalibrationVerdict::kOk);
  const auto size = Eigen::Index(result.parameters.size());
  ASSERT_EQ(result.covariance.rows(), size);
  ASSERT_EQ(result.covariance.cols(), size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const double sigma = result.parameters[std::size_t(i)].sigma;
    EXPECT_GT(sigma, 0);
    EXPECT_DOUBLE_EQ(result.covariance(i, i), sigma * sigma);
  }
  // The upper view's azimuth is the sum of two others, in the covariance with every other parameter too.
  const auto row = [&](const char* name) { return result.covariance.row(Eigen::Index(index_of(result, name))); };
  const Eigen::RowVectorXd sum = row("lower.azimuth_rad") + row("upper.azimuth_minus_lower_rad");
  const Eigen::RowVectorXd of_sum = row("upper.azimuth_rad");
  // The rounding of central differences of doubles over a step of 1e-3.
  constexpr double kRelative = 1e-9;
  for (Eigen::Index i = 0; i < size; ++i) {
    const double unit = parameter(result, "upper.azimuth_rad").sigma * result.parameters[std::size_t(i)].sigma;
    EXPECT_NEAR(of_sum[i], sum[i], kRelative * unit) << result.parameters[std::size_t(i)].name;
  }
}

/// The level of 3 sigmas of one Gaussian, two-sided: exp(-x / 2) = 0.0027.
constexpr double kChiSquaredLimit = 11.83;

void expect_moved(const CalibrationResult& result, const std::vector<Landmark>& map,
                  const std::map<std::size_t, Eigen::Vector2d>& truth_m) {
  ASSERT_EQ(result.verdict, CalibrationVerdict::kOk);
  ASSERT_EQ(result.landmark_shifts.size(), map.size());
  for (const RelativeShift& s : shifts_among(result, map, kChiSquaredLimit)) {
    const bool is_moved = truth_m.contains(s.shift.landmark);
    const Eigen::Vector2d sigma_m = s.shift.covariance.diagonal().cwiseSqrt();
    if (shows()) {
      fmt::print("landmark {}: {:6.2f} {:6.2f} mm +- {:.2f} {:.2f}, chi-squared {:.1f}; marginal sigma {:.2f} mm\n",
                 s.shift.landmark, 1e3 * s.shift.shift_m.x(), 1e3 * s.shift.shift_m.y(), 1e3 * sigma_m.x(),
                 1e3 * sigma_m.y(), s.chi_squared,
                 1e3 * std::sqrt(result.landmark_shifts[s.shift.landmark].covariance(0, 0)));
    }
    EXPECT_EQ(s.moved, is_moved) << s.shift.landmark << " chi-squared " << s.chi_squared;
    const Eigen::Vector2d truth = is_moved ? truth_m.at(s.shift.landmark) : Eigen::Vector2d::Zero();
    for (const int axis : {0, 1}) {
      EXPECT_NEAR(s.shift.shift_m[axis], truth[axis], kCalibrationSigmas * sigma_m[axis]) << s.shift.landmark;
      // A useful accuracy is a sixth of the planted shift.
      EXPECT_LT(sigma_m[axis], 0.02 / 6) << s.shift.landmark;
    }
  }
}

TEST(CalibrationMap, FindsTheMovedLandmarkAndNoOther) {
  DriveSettings world = with_rig_errors({.duration_s = kShortDrive_s});
  world.landmarks[2].x_m += 0.016;
  world.landmarks[2].y_m -= 0.012;
  CalibrationProblem problem = timed_problem(world);
  doubt(problem, 0.01);
  expect_moved(calibrate(problem), problem.landmarks, {{2, {0.016, -0.012}}});
}

TEST(CalibrationMap, FindsTwoWithTimesAndSystematicErrorsAllowed) {
  DriveSettings world{.latency_s = 0.025, .upper_skew_s = 0.008};
  world.landmarks[0].y_m += 0.02;
  world.landmarks[4].x_m -= 0.012;
  world.landmarks[4].y_m -= 0.016;
  CalibrationProblem problem = timed_problem(world);
  problem.systematic_px = 0.025;
  doubt(problem, 0.01);
  const CalibrationResult result = calibrate(problem);
  expect_moved(result, problem.landmarks, {{0, {0, 0.02}}, {4, {-0.012, -0.016}}});
  expect_times(result, world);
}

/// A map that is shifted as a whole, and measured with another ruler, moves none of its landmarks.
TEST(CalibrationMap, ACommonShiftTurnAndScaleIsNoLandmarks) {
  DriveSettings world{.duration_s = 8};
  const Eigen::Rotation2Dd turn(0.01);
  for (Landmark& l : world.landmarks) {
    const Eigen::Vector2d measured_m = 1.006 * (turn * place_m(l)) + Eigen::Vector2d(0.02, -0.03);
    l.x_m = measured_m.x();
    l.y_m = measured_m.y();
  }
  CalibrationProblem problem = timed_problem(world);
  doubt(problem, 0.01);
  expect_moved(calibrate(problem), problem.landmarks, {});
}

TEST(CalibrationMap, ATrustedMapHasNoShifts) {
  const DriveSettings world{.duration_s = 4};
  const CalibrationProblem problem = timed_problem(world);
  const CalibrationResult result = calibrate(problem);
  ASSERT_EQ(result.verdict, CalibrationVerdict::kOk);
  EXPECT_TRUE(result.landmark_shifts.empty());
  EXPECT_TRUE(shifts_among(result, problem.landmarks, kChiSquaredLimit).empty());
}

TEST(CalibrationTiming, RefusesBadArguments) {
  const DriveSettings world{.duration_s = 4};
  CalibrationProblem problem = timed_problem(world);
  problem.frames[2].sightings[1].late_s = std::nan("");
  problem.frames[3].twist->turn_radps = std::numeric_limits<double>::infinity();
  problem.landmarks[1].sigma.y_m = -1;
  problem.height_px[1] = -1;
  problem.priors.readout_s = 0;
  const std::string error = testing_support::error_of<std::invalid_argument>([&] { calibrate(problem); });
  for (const char* part : {"frame 2 has a sighting whose late_s", "frame 3 has a twist", "landmark 1 has a sigma",
                           "height_px", "prior's sigma is 0"}) {
    EXPECT_THAT(error, testing::HasSubstr(part));
  }
}

}  // namespace
}  // namespace twocone::vision

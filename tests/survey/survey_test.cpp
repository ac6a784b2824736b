// SPDX-License-Identifier: Apache-2.0
// Surveys of a room in images whose pixels are exactly known, from runs as they are on disk.
#include "apps/survey/survey.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "apps/config/to_layers.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/survey/rough_map.h"
#include "localisation/odometry.h"
#include "tests/support/lab_robot.h"
#include "tests/support/synthetic_lab.h"
#include "tests/support/temporary_folder.h"

namespace twocone::survey {
namespace {

using testing::Each;
using testing::HasSubstr;
using testing::UnorderedElementsAre;
using testing_support::landmark;
using testing_support::seen_from;
using testing_support::SyntheticLandmark;
using testing_support::SyntheticRig;
using testing_support::SyntheticScene;
using testing_support::TemporaryFolder;

constexpr int kFrames = 36;
constexpr double kFrame_s = 0.5;

const SyntheticRig& lab() {
  static const SyntheticRig rig(vision::lab_rig());
  return rig;
}

config::Robot robot() {
  config::Robot robot = testing_support::lab_robot("memory");
  robot.start = Pose2{0.1, -0.8, 0.2};
  return robot;
}

/// Seven landmarks of different radii and tops; two of them are red.
std::vector<SyntheticLandmark> room() {
  std::vector<SyntheticLandmark> landmarks = testing_support::six_landmarks();
  landmarks.push_back(landmark(0.4, 2.7, landmarks[0].colour));
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    landmarks[i].radius_m = 0.09 + 0.01 * double(i);
    landmarks[i].top_m = 0.86 + 0.02 * double(i % 4);
  }
  return landmarks;
}

Image to_image(const cv::Mat& rgb) {
  return {rgb.cols, rgb.rows, PixelFormat::kRgb8, std::vector<std::uint8_t>(rgb.datastart, rgb.dataend)};
}

/// Writes the images of a drive on a circle, and returns the run. @param passing added to the frames in which it is
runlog::RunData drive(const TemporaryFolder& folder, const std::vector<SyntheticLandmark>& landmarks,
                      const std::vector<std::optional<SyntheticLandmark>>& passing = {},
                      const Pose2& start = *robot().start) {
  runlog::RunData run;
  run.folder = folder.path();
  run.robot = robot();
  run.map.file = "room.map.yaml";
  run.map.bounds = {-4, 4, -4, 4};
  std::mt19937_64 random(11);
  localisation::Pose pose = start;
  double left_rad = 0;
  double right_rad = 0;
  std::filesystem::create_directories(folder.path() / "lower");
  std::filesystem::create_directories(folder.path() / "upper");
  for (int i = 0; i < kFrames; ++i) {
    if (i > 0) {
      const double left = 2.0;
      const double right = i % 12 < 8 ? 3.4 : 2.6;
      left_rad += left;
      right_rad += right;
      pose = localisation::drive_arc(pose, 0.05 * left, 0.05 * right, 0.30);
    }
    const double t_s = i * kFrame_s;
    runlog::FrameRow frame;
    frame.frame = std::uint64_t(i);
    frame.t_s = frame.lower_t_s = frame.upper_t_s = t_s;
    run.frames.push_back(frame);
    run.drive.push_back({t_s, {}, {}, left_rad, right_rad});
    run.odometry.push_back({t_s, pose.x_m, pose.y_m, pose.heading_rad});
    std::vector<SyntheticLandmark> all = landmarks;
    if (std::size_t(i) < passing.size() && passing[std::size_t(i)]) all.push_back(*passing[std::size_t(i)]);
    // The images stand still while they are exposed: what a moving body does to them is tested elsewhere.
    const SyntheticScene scene{seen_from(all, {pose.x_m, pose.y_m}, pose.heading_rad), {}, {}};
    const auto pair = lab().take(scene, {.noise_grey_levels = 1.5}, random);
    runlog::write_image(runlog::lower_image_file(folder.path(), frame.frame), to_image(pair.lower));
    runlog::write_image(runlog::upper_image_file(folder.path(), frame.frame), to_image(pair.upper));
  }
  return run;
}

/// Catches landmarks that are found twice or not at all, and a person who becomes a landmark.
void expect_each_once(const Report& report) {
  std::vector<std::string> names;
  for (const SurveyedLandmark& l : report.landmarks) names.push_back(l.landmark.name);
  EXPECT_THAT(names, UnorderedElementsAre("red.1", "red.2", "green.1", "blue.1", "cyan.1", "magenta.1", "yellow.1"));
  EXPECT_THAT(report.left_out, testing::Not(testing::IsEmpty()));
  EXPECT_THAT(report.left_out, Each(HasSubstr("orange")));
}

/// Catches errors of places, tops and radii, and sigmas that are not theirs. What the images of a view share beyond the
/// stated errors is 0.03 px (outline_ranging_test.cpp, kQuiet_px), in metres of range at two metres.
void expect_places(const Report& report) {
  constexpr double kQuiet_m = 0.03 / 85;
  constexpr double kSigmas = 3.5;  // by chance once in 2000; there are 28 numbers
  const std::vector<SyntheticLandmark> truth = room();
  for (std::size_t i = 0; i < report.landmarks.size(); ++i) {
    const Landmark& l = report.landmarks[i].landmark;
    const auto apart = [&](const SyntheticLandmark& t) { return (t.centre_m - vision::place_m(l)).norm(); };
    const SyntheticLandmark& is = *std::ranges::min_element(truth, {}, apart);
    const auto expect = [&](double found_m, double true_m, double sigma_m) {
      EXPECT_LT(std::abs(found_m - true_m), kSigmas * std::hypot(sigma_m, kQuiet_m)) << l.name << " +- " << sigma_m;
      EXPECT_LT(sigma_m, 0.002) << l.name;
    };
    expect(l.x_m, is.centre_m.x(), l.sigma.x_m);
    expect(l.y_m, is.centre_m.y(), l.sigma.y_m);
    expect(l.top_m, is.top_m, l.sigma.top_m);
    expect(l.radius_m, is.radius_m, l.sigma.radius_m);
    const Eigen::Index at = vision::kRigNumbers + vision::kLandmarkNumbers * Eigen::Index(i);
    EXPECT_NEAR(l.sigma.x_m, std::sqrt(report.solution.result.belief_covariance(at, at)), 1e-12);
  }
}

/// Catches a file from which the robot reads other uncertainties than the survey found.
void expect_file(const Report& report) {
  const TemporaryFolder folder;
  config::Map map;
  map.survey = folder.write("room.survey.json", to_json(report));
  for (const SurveyedLandmark& l : report.landmarks) map.landmarks.push_back(l.landmark);
  const config::BeliefErrors errors = config::to_belief_errors(robot(), map);
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    for (std::size_t k = 0; k < map.landmarks.size(); ++k) {
      const Eigen::Index a = vision::kRigNumbers + vision::kLandmarkNumbers * Eigen::Index(i);
      const Eigen::Index b = vision::kRigNumbers + vision::kLandmarkNumbers * Eigen::Index(k);
      const Eigen::Matrix4d mixed = errors.vision.landmarks[i] * errors.vision.landmarks[k].transpose();
      EXPECT_LT((mixed - report.solution.result.belief_covariance.block<4, 4>(a, b)).cwiseAbs().maxCoeff(), 1e-12);
    }
  }
  EXPECT_GT(errors.vision.sighting_px, 0);
  // A landmark that was moved by hand has the map's own sigma.
  map.landmarks[0].x_m += 0.01;
  const config::BeliefErrors moved = config::to_belief_errors(robot(), map);
  EXPECT_EQ((moved.vision.landmarks[0] * moved.vision.landmarks[1].transpose()).cwiseAbs().maxCoeff(), 0);
}

void expect_table_and_figure(const Report& report) {
  const std::string text = table(report);
  const std::string svg = figure(report);
  for (const SurveyedLandmark& l : report.landmarks) {
    EXPECT_THAT(text, HasSubstr(l.landmark.name));
    EXPECT_THAT(svg, HasSubstr(">" + l.landmark.name + "<"));
  }
  EXPECT_THAT(svg, testing::Not(HasSubstr("nan")));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line) && !line.starts_with("3");) EXPECT_LE(line.size(), 100U) << line;
  const auto json = nlohmann::json::parse(to_json(report));
  EXPECT_EQ(json["landmarks"].size(), report.landmarks.size());
  EXPECT_GE(json["landmarks"][0]["ellipse_95"]["major_m"], json["landmarks"][0]["ellipse_95"]["minor_m"]);
}

// One survey serves all, because it takes seconds.
TEST(Survey, FindsTheMapOfARoom) {
  const TemporaryFolder folder;
  std::vector<std::optional<SyntheticLandmark>> passing(kFrames);
  // A person in orange walks through the room, half a metre from frame to frame.
  for (int i = 8; i < 18; ++i) passing[std::size_t(i)] = landmark(-2.2 + 0.45 * (i - 8), 0.9, {0.6, 0.31, 0.02}, 0.2);
  const auto found = survey({drive(folder, room(), passing)}, robot(), {});
  ASSERT_TRUE(found) << found.error().message;
  expect_each_once(*found);
  expect_places(*found);
  expect_file(*found);
  expect_table_and_figure(*found);
}

// Catches a start that needs a rig that is known: the robot file has the camera turned by two radians, the mirrors'
// places in the images off by some pixels, and sizes from a ruler.
TEST(Survey, FindsARigThatARulerMeasured) {
  const TemporaryFolder folder;
  const runlog::RunData run = drive(folder, room());
  config::Robot by_ruler = robot();
  for (config::RigView* view : {&by_ruler.rig.lower, &by_ruler.rig.upper}) {
    view->azimuth_rad += 2.1;
    view->centre_px[0] += 9;
    view->centre_px[1] -= 7;
    view->rim_radius_px *= 1.02;
  }
  by_ruler.rig.lower.azimuth_rad += 0.2;
  by_ruler.rig.mirror_separation_m += 0.002;
  by_ruler.rig.sigma = config::ruler_sigma(by_ruler.rig);
  by_ruler.rig.sigma->azimuth_rad = 1.8;
  Settings settings;
  settings.calibrates = true;
  settings.priors = calibrate::priors_of(by_ruler);
  settings.frames = 20;
  const auto found = survey({run}, by_ruler, settings);
  ASSERT_TRUE(found) << found.error().message;
  const vision::Rig& rig = found->solution.after;
  for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
    const vision::MirrorViewSettings& is = of_view(lab().rig, side).settings();
    const vision::MirrorViewSettings& seen = of_view(rig, side).settings();
    EXPECT_LT((seen.centre_px - is.centre_px).norm(), 1.5) << to_string(side);
    EXPECT_LT(std::abs(localisation::wrap_angle_rad(seen.azimuth_rad - is.azimuth_rad)), 0.02) << to_string(side);
  }
  EXPECT_EQ(found->landmarks.size(), room().size());
}

// Catches a measured map that does not count, or that counts where a landmark was moved: its world is not the drive's.
TEST(Survey, RefinesAMeasuredMap) {
  const TemporaryFolder folder;
  const Eigen::Rotation2Dd turn(0.7);
  Settings settings;
  std::vector<Landmark> truth;
  for (const SyntheticLandmark& l : room()) {
    const Eigen::Vector2d place_m = turn * l.centre_m + Eigen::Vector2d(0.3, -0.2);
    truth.push_back({.name = fmt::format("pipe{}", truth.size()),
                     .colour = {l.colour[0], l.colour[1], l.colour[2]},
                     .x_m = place_m.x(),
                     .y_m = place_m.y(),
                     .radius_m = l.radius_m,
                     .top_m = l.top_m,
                     .sigma = {0.003, 0.003, 0.001, 0.001}});
  }
  settings.measured = truth;
  settings.measured[2].y_m -= 0.05;
  const auto found = survey({drive(folder, room())}, robot(), settings);
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->moved.size(), 1U) << table(*found);
  EXPECT_EQ(found->moved[0].name, "pipe2");
  EXPECT_NEAR(found->moved[0].by_m.y(), 0.05, 3.5 * found->moved[0].sigma_m);
  EXPECT_THAT(table(*found), HasSubstr("pipe2 was moved by"));
  ASSERT_EQ(found->landmarks.size(), truth.size());
  for (const SurveyedLandmark& l : found->landmarks) {
    const auto is = std::ranges::find(truth, l.landmark.name, &Landmark::name);
    ASSERT_NE(is, truth.end()) << l.landmark.name;
    EXPECT_LT(std::abs(l.landmark.x_m - is->x_m), 3.5 * l.landmark.sigma.x_m) << l.landmark.name;
    EXPECT_LT(std::abs(l.landmark.y_m - is->y_m), 3.5 * l.landmark.sigma.y_m) << l.landmark.name;
    EXPECT_LT(l.landmark.sigma.x_m, 0.003) << l.landmark.name;
  }
}

// Catches a second run whose world is taken for that of the first: it starts elsewhere, where nobody knows.
TEST(Survey, LaysASecondRunOntoTheFirst) {
  const TemporaryFolder first;
  const TemporaryFolder second;
  const std::vector<runlog::RunData> runs{drive(first, room()), drive(second, room(), {}, {-0.4, 0.5, 2.4})};
  const calibrate::ChosenFrames chosen = calibrate::choose_frames(runs, 2 * kFrames, 1);
  const auto rough = find_rough_map(runs, chosen, robot());
  ASSERT_TRUE(rough) << rough.error().message;
  EXPECT_EQ(rough->landmarks.size(), 7U);
  for (const SyntheticLandmark& l : room()) {
    const auto apart = [&](const Landmark& found) { return (vision::place_m(found) - l.centre_m).norm(); };
    EXPECT_LT(std::ranges::min(rough->landmarks, {}, apart).x_m - l.centre_m.x(), 0.06);
  }
  ASSERT_EQ(rough->poses.size(), chosen.frames.size());
  const Eigen::Vector3d& pose = *rough->poses[kFrames - 1];  // the first of the second run
  const Pose2 is = localisation::drive_arc({-0.4, 0.5, 2.4}, 0.05 * 2.0, 0.05 * 3.4, 0.30);
  EXPECT_NEAR(pose.x(), is.x_m, 0.05);
  EXPECT_NEAR(pose.y(), is.y_m, 0.05);
  EXPECT_NEAR(localisation::wrap_angle_rad(pose.z() - is.heading_rad), 0, 0.03);
  // Another room has no landmarks of the first.
  const TemporaryFolder elsewhere;
  const std::vector<runlog::RunData> rooms{
      runs[0], drive(elsewhere, {landmark(1.9, 0.6, {0.6, 0.02, 0.02}), landmark(-1.2, 1.6, {0.02, 0.6, 0.02})})};
  const auto refused = find_rough_map(rooms, calibrate::choose_frames(rooms, 2 * kFrames, 1), robot());
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("of its landmarks are those of"));
}

TEST(Survey, RefusesInOneLine) {
  const auto message = [](const std::vector<runlog::RunData>& runs, const Settings& settings) -> std::string {
    const auto result = survey(runs, robot(), settings);
    return result ? "a report" : result.error().message;
  };
  const TemporaryFolder grey;
  EXPECT_THAT(message({drive(grey, {})}, {}), HasSubstr("0 landmarks of a vivid colour or with bands were found"));
  const TemporaryFolder gone;
  runlog::RunData run = drive(gone, {});
  std::filesystem::remove(runlog::lower_image_file(gone.path(), 5));
  EXPECT_THAT(message({run}, {}), HasSubstr("000005.png"));
  run.odometry.clear();
  run.drive.clear();
  EXPECT_THAT(message({run}, {}), HasSubstr("the wheels were not recorded"));
  EXPECT_THROW((void)survey({}, robot(), {}), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::survey

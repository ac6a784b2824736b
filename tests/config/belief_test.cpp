// SPDX-License-Identifier: Apache-2.0
// How sure the robot is of what it believes: the keys sigma, sigma_m and landmark_sigma_m, and calibration files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "apps/config/calibration_file.h"
#include "apps/config/to_layers.h"
#include "tests/config/fixtures.h"
#include "tests/support/temporary_folder.h"
#include "vision/uncertain_rig.h"

namespace twocone::config {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing_support::TemporaryFolder;

Robot robot_with(const std::string& rig_lines, const std::string& drive_lines = "") {
  std::string text = with(good_robot_text(), "  lens_height_m: 0.23\n", "  lens_height_m: 0.23\n" + rig_lines);
  if (!drive_lines.empty()) text = with(text, "drive:\n", "drive:\n" + drive_lines);
  return parse_robot(parse_yaml(text, "robot.yaml"), data("robot.yaml"));
}

Map good_map() { return read_map(data("good_map.yaml")); }

/// Standard deviations of all that is believed, in the order of belief_names().
Eigen::VectorXd sigmas_of(const BeliefErrors& errors) {
  Eigen::VectorXd all(vision::kRigNumbers + vision::kLandmarkNumbers * Eigen::Index(errors.vision.landmarks.size()));
  all.head<vision::kRigNumbers>() = errors.vision.rig.rowwise().norm();
  Eigen::Index at = vision::kRigNumbers;
  for (const auto& landmark : errors.vision.landmarks) {
    all.segment<vision::kLandmarkNumbers>(at) = landmark.rowwise().norm();
    at += vision::kLandmarkNumbers;
  }
  return all;
}

TEST(Belief, AKeyThatIsAbsentHasTheRulersValue) {
  const Robot robot = robot_with("  sigma: {centre_px: 0.4, tilt_rad: 0}\n");
  ASSERT_TRUE(robot.rig.sigma.has_value());
  const RigSigma ruler = ruler_sigma(robot.rig);
  RigSigma wanted = ruler;
  wanted.centre_px = 0.4;
  wanted.tilt_rad = 0;
  EXPECT_EQ(*robot.rig.sigma, wanted);
  EXPECT_FALSE(robot_with("").rig.sigma.has_value());
  EXPECT_EQ(sigmas_of(to_belief_errors(robot_with(""), good_map())).head(2),
            Eigen::Vector2d::Constant(ruler.centre_px));
}

TEST(Belief, ZeroIsExact) {
  const Robot robot = robot_with("  sigma: 0\n", "  sigma: 0\n");
  EXPECT_EQ(*robot.rig.sigma, RigSigma{});
  EXPECT_EQ(*robot.drive.sigma, WheelSigma{});
  Map map = good_map();
  for (Landmark& landmark : map.landmarks) landmark.sigma = {};
  const BeliefErrors errors = to_belief_errors(robot, map);
  EXPECT_EQ(errors.vision.rig.cols(), 0);
  EXPECT_EQ(errors.wheels.cols(), 0);
  EXPECT_EQ(errors.places.front().cols(), 0);
}

TEST(Belief, EveryNumberHasItsOwnError) {
  const Robot robot = robot_with("  sigma: {}\n", "  sigma: {wheel_radius_m: 0.001, wheel_ratio: 0.02}\n");
  const BeliefErrors errors = to_belief_errors(robot, good_map());
  // 2 x 13 of the views, 2 of the rig, 2 x 4 of the landmarks, 3 of the wheels, 4 of the exposures.
  EXPECT_EQ(errors.vision.rig.cols(), 26 + 2 + 8 + 3 + 4);
  const Eigen::VectorXd sigmas = sigmas_of(errors);
  EXPECT_EQ(sigmas[vision::kSeparation], 0.003);
  EXPECT_EQ(sigmas[int(vision::kRigNumbers) + vision::kTop], 0.002) << "of the first landmark, as its map states";
  EXPECT_EQ(sigmas[int(vision::kRigNumbers) + vision::kLandmarkNumbers + vision::kPlaceX], kTapeSigma.x_m);
  // The wheels: 0.001 of the radius is common to both, half of the ratio's error is on either side.
  const Eigen::Matrix3d by_wheels = errors.wheels.rightCols<7>().leftCols<3>();
  const Eigen::Vector2d common = by_wheels.col(0).head<2>();
  EXPECT_DOUBLE_EQ(common[0], 0.001 / robot.drive.wheel_radius_m);
  EXPECT_DOUBLE_EQ(common[1], common[0]);
  EXPECT_DOUBLE_EQ(by_wheels(0, 1), -0.01);
  EXPECT_DOUBLE_EQ(by_wheels(1, 1), 0.01);
  EXPECT_EQ(errors.vision.times.rightCols<4>(), Eigen::Matrix4d(0.01 * Eigen::Matrix4d::Identity()));
}

TEST(Belief, OneNoteNamesAllThatStatesNone) {
  const std::string note = ruler_note(robot_with(""), good_map());
  for (const char* part : {"rig: of", "drive: of", "1 landmarks of", "green"}) EXPECT_THAT(note, HasSubstr(part));
  Map map = good_map();
  map.without_sigma.clear();
  EXPECT_EQ(ruler_note(robot_with("  sigma: 0\n", "  sigma: 0\n"), map), "");
}

TEST(Belief, WrongSigmasAreRefused) {
  const auto message = [](const std::string& lines) { return message_of([&] { robot_with(lines); }); };
  EXPECT_THAT(message("  sigma: 0.1\n"), HasSubstr("rig.sigma is 0.1, must be 0 (all is exact) or a mapping"));
  EXPECT_THAT(message("  sigma: {centre_px: -1}\n"), HasSubstr("rig.sigma.centre_px is -1 px, must be >= 0"));
  EXPECT_THAT(message("  sigma: {centre: 1}\n"), HasSubstr("centre"));
  EXPECT_THAT(message("  sigma: 0\n  calibration: x.json\n"), HasSubstr("must be absent beside calibration"));
}

TEST(Belief, TheRootOfACovarianceGivesItBack) {
  Eigen::Matrix4d covariance;
  covariance << 4, 1.5, 0, 1e-4, 1.5, 1, 0, 2e-5, 0, 0, 0, 0, 1e-4, 2e-5, 0, 1e-8;
  const Eigen::MatrixXd root = root_of(covariance);
  EXPECT_EQ(root.cols(), 3);
  EXPECT_LT((root * root.transpose() - covariance).cwiseAbs().maxCoeff(), 1e-14);
  const Eigen::MatrixXd diagonal = root_of(Eigen::Vector3d(4, 0, 9).asDiagonal());
  Eigen::MatrixXd wanted(3, 2);
  wanted << 2, 0, 0, 0, 0, 3;
  EXPECT_EQ(diagonal, wanted);
}

/// A calibration of the good robot on the good map, whose errors are all correlated.
class CalibrationFile : public testing::Test {
 protected:
  CalibrationFile() {
    const Robot robot = robot_with("");
    const Map map = good_map();
    names_ = belief_names(map);
    const Eigen::VectorXd values = belief_values(robot, map);
    const auto count = values.size();
    covariance_ = 1e-6 * (Eigen::MatrixXd::Identity(count, count) + Eigen::MatrixXd::Constant(count, count, 0.5));
    json_["belief"] = {{"names", names_}, {"values", std::vector<double>(values.begin(), values.end())}};
    for (const auto& row : covariance_.rowwise()) {
      json_["belief"]["covariance"].push_back(std::vector<double>(row.begin(), row.end()));
    }
  }

  /// @returns the errors of the good robot with this file @param map a map of its own
  BeliefErrors errors(const Map& map = good_map()) const {
    Robot robot = robot_with("");
    robot.rig.calibration = folder_.write("good.calibration.json", json_.dump());
    return to_belief_errors(robot, map);
  }
  std::string message() const {
    return message_of([&] { errors(); });
  }

  TemporaryFolder folder_;
  std::vector<std::string> names_;
  Eigen::MatrixXd covariance_;
  nlohmann::json json_;
};

TEST_F(CalibrationFile, GivesTheJointCovarianceOfRigMapAndWheels) {
  const BeliefErrors all = errors();
  EXPECT_EQ(all.vision.rig.cols(), covariance_.rows());
  const Eigen::MatrixXd rig = all.vision.rig * all.vision.rig.transpose();
  EXPECT_LT((rig - covariance_.topLeftCorner<vision::kRigNumbers, vision::kRigNumbers>()).cwiseAbs().maxCoeff(), 1e-15);
  const Eigen::MatrixXd mixed = all.vision.rig * all.vision.landmarks[1].transpose();
  EXPECT_NEAR(mixed(3, vision::kTop), 0.5e-6, 1e-15) << "rig and map were found together";
}

TEST_F(CalibrationFile, ALandmarkElsewhereIsIndependentOfIt) {
  Map map = good_map();
  map.landmarks[1].x_m += 0.01;
  const BeliefErrors all = errors(map);
  const Eigen::MatrixXd mixed = all.vision.rig * all.vision.landmarks[1].transpose();
  EXPECT_LT(mixed.cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_NEAR(all.vision.landmarks[1].row(vision::kPlaceX).norm(), kTapeSigma.x_m, 1e-12);
  EXPECT_NEAR((all.vision.rig * all.vision.landmarks[0].transpose())(3, 0), 0.5e-6, 1e-15);
}

TEST_F(CalibrationFile, GivesTheErrorOfEachSighting) {
  EXPECT_EQ(errors().vision.sighting_px, 0) << "a file of a version that did not count it";
  json_["systematic_px"] = 0.1;
  EXPECT_DOUBLE_EQ(errors().vision.sighting_px, std::sqrt(3.0) * 0.1);
  json_["systematic_px"] = -1;
  EXPECT_THAT(message(), HasSubstr("systematic_px is -1, must be a number >= 0"));
}

TEST_F(CalibrationFile, OtherTimesOfExposureAreIndependentOfIt) {
  const auto mixed = [&](double late_s) {
    Robot robot = robot_with("");
    robot.rig.lower.late_s = late_s;
    robot.rig.calibration = folder_.write("good.calibration.json", json_.dump());
    const BeliefErrors all = to_belief_errors(robot, good_map());
    return (all.vision.rig * all.vision.times.transpose())(3, vision::kReadoutOfUpper);
  };
  EXPECT_NEAR(mixed(0), 0.5e-6, 1e-15);
  EXPECT_NEAR(mixed(0.001), 0, 1e-15);
}

TEST_F(CalibrationFile, OfAnotherRigIsRefused) {
  json_["belief"]["values"][0] = 17;
  EXPECT_THAT(message(), HasSubstr("rig: lower.centre_px.column is 318.25"));
  EXPECT_THAT(message(), HasSubstr("is of a rig with 17: calibrate again"));
}

TEST_F(CalibrationFile, ThatIsDamagedIsRefusedInOneLine) {
  const nlohmann::json good = json_;
  json_["belief"]["covariance"][2][3] = 5;
  EXPECT_THAT(message(), HasSubstr("belief.covariance is no covariance"));
  json_ = good;
  json_["belief"]["names"].erase(3);
  EXPECT_THAT(message(), HasSubstr("so it must have as many values"));
  json_ = good;
  json_["belief"].erase("values");
  EXPECT_THAT(message(), HasSubstr("belief.values is missing"));
  json_ = {{"robot", "x"}};
  EXPECT_THAT(message(), HasSubstr("belief is missing"));
  json_ = good;
  Robot robot = robot_with("");
  robot.rig.calibration = folder_.write("torn.json", good.dump().substr(0, 100));
  EXPECT_THAT(message_of([&] { to_belief_errors(robot, good_map()); }), HasSubstr("torn.json: is no JSON"));
}

TEST_F(CalibrationFile, ASurveyReplacesWhatTheMapStatesOfTheLandmarks) {
  json_["systematic_px"] = 0.1;
  Map map = good_map();
  map.survey = folder_.write("good.survey.json", json_.dump());
  const auto mixed = [](const BeliefErrors& all) {
    return (all.vision.rig * all.vision.landmarks[0].transpose())(3, 0);
  };
  const BeliefErrors same_rig = to_belief_errors(robot_with(""), map);
  EXPECT_NEAR(mixed(same_rig), 0.5e-6, 1e-15) << "rig and map were found together";
  EXPECT_DOUBLE_EQ(same_rig.vision.sighting_px, std::sqrt(3.0) * 0.1);
  // Another robot has the map's errors, but not those of the rig that surveyed.
  Robot other = robot_with("");
  other.rig.lower.rim_radius_px += 1;
  const BeliefErrors all = to_belief_errors(other, map);
  EXPECT_NEAR(mixed(all), 0, 1e-15);
  EXPECT_NEAR((all.vision.landmarks[0] * all.vision.landmarks[1].transpose())(1, 2), 0.5e-6, 1e-15);
  map.survey = folder_.path() / "none.json";
  EXPECT_THAT(message_of([&] { to_belief_errors(other, map); }), HasSubstr("none.json"));
}

TEST(MapText, HasTheLandmarksOfTheCalibration) {
  const TemporaryFolder folder;
  Map map = good_map();
  map.landmarks[1].top_m = 1.0625;
  map.landmarks[1].sigma = {.x_m = 0.001, .y_m = 0.002, .top_m = 0.0003, .radius_m = 0.0001};
  const fs::path file = folder.write("new.map.yaml", "");
  map.scene.reset();
  const std::string text = map_text(data("good_map.yaml"), file, map, {"A line."});
  EXPECT_THAT(text, HasSubstr("# A line."));
  const Map again = read_map(folder.write("new.map.yaml", text));
  EXPECT_EQ(again.landmarks, map.landmarks);
  EXPECT_TRUE(again.without_sigma.empty());
  EXPECT_EQ(fs::weakly_canonical(*again.scene), fs::weakly_canonical(*good_map().scene));
  EXPECT_EQ(again.obstacles, map.obstacles);
}

}  // namespace
}  // namespace twocone::config

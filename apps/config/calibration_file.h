// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "vision/uncertain_rig.h"

/// The joint uncertainty of what a calibration found and of what it kept (STEM.calibration.json, key `belief`).
namespace twocone::config {

struct Calibration {
  std::vector<std::string> names;  ///< of the numbers, as belief_names() lists them
  Eigen::VectorXd values;          ///< of the numbers, in the units that their names end in
  Eigen::MatrixXd covariance;      ///< of their errors, symmetric and positive semi-definite
  double sighting_px = 0;          ///< vision::BeliefErrors::sighting_px, >= 0
};

/// Numbers of the wheels in belief_names().
constexpr int kWheelNumbers = 3;

/// Returns the name of the calibration that belongs to a robot file: STEM.calibration.json beside it.
std::filesystem::path calibration_file_of(const std::filesystem::path& robot_file);

/// Returns the names of all that a robot believes: the rig's numbers (vision::RigNumber), the numbers of each landmark
/// (vision::LandmarkNumber) as "landmark NAME x_m", wheel_radius_m, wheel_ratio, wheel_separation_m, then the times of
/// exposure (vision::TimeNumber), as "lower.late_s".
std::vector<std::string> belief_names(const Map& map);

/// Returns the numbers themselves, in that order. The wheels' ratio is 1.
Eigen::VectorXd belief_values(const Robot& robot, const Map& map);

/// Reads the keys `belief` and `systematic_px` of a calibration file.
/// @throws FileError in one line: a file that cannot be read or is no JSON, a missing key, numbers that are not finite,
/// a systematic_px below 0, a covariance of another size or one that is not symmetric or not positive semi-definite
Calibration read_calibration(const std::filesystem::path& file);

/// Returns the covariance of belief_values(): that of the calibration for the numbers that it states, and the squares
/// of `sigmas` for the others. A landmark that is elsewhere than in the calibration, as on another map, is such
/// another; so are wheels and times of exposure that differ.
/// @throws FileError if a number of `rig:` is not the one that was calibrated, and names it
Eigen::MatrixXd belief_covariance(const Calibration& calibration, const Robot& robot, const Map& map,
                                  const Eigen::VectorXd& sigmas);

/// Returns `covariance`, of belief_values(), with that of a survey of the map (Map::survey) in place of what it states
/// of the landmarks. If the robot's rig is the one that surveyed, the survey's joint covariance of rig and landmarks
/// replaces both, because their errors belong together. Landmarks that are elsewhere than in the survey keep theirs.
Eigen::MatrixXd with_survey(const Calibration& survey, const Robot& robot, const Map& map, Eigen::MatrixXd covariance);

/// Returns a matrix R with one column for each independent error of variance 1: covariance = R R^T. Numbers of variance
/// 0 have zero rows. A diagonal covariance gives one column for each number.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance);

/// Returns the part of root_of() the covariance of belief_values() that vision uses. @param landmarks how many there
/// are
vision::BeliefErrors vision_errors(const Eigen::MatrixXd& by_shared, std::size_t landmarks, double sighting_px);

}  // namespace twocone::config

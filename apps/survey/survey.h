// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/calibrate/calibrate.h"
#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"
#include "apps/survey/refine.h"
#include "base/plane.h"
#include "hal/result.h"

/// The map of a room from a drive: number, colours, places, radii and tops of its landmarks are not known beforehand.
namespace twocone::survey {

/// A distance between the axes of two landmarks, which are known by their names in the survey.
struct TapeDistance {
  std::string from, to;
  double distance_m = 0;   ///< > 0
  double sigma_m = 0.002;  ///< > 0
};

struct Settings {
  int frames = 180;         ///< number of frames, >= 4; evenly spread over the runs in proportion to their length
  bool calibrates = false;  ///< the rig is found, too, within its priors; false: it is held as believed
  vision::CalibrationPriors priors{};
  std::vector<TapeDistance> distances{};
  /// The landmarks of a measured map: it is refined within their sigmas. Empty: there is none.
  std::vector<Landmark> measured{};
  std::function<void(double)> progress;  ///< called with the fraction of the work that is done; may be empty
};

struct SurveyedLandmark {
  Landmark landmark;  ///< its sigma is that of the survey
  std::size_t sightings = 0;
  std::size_t outliers = 0;  ///< of the sightings
};

struct Report {
  std::vector<SurveyedLandmark> landmarks;
  std::vector<MovedLandmark> moved;   ///< landmarks of the measured map that are elsewhere
  std::vector<std::string> left_out;  ///< what was seen and is no landmark or not seen and is one, a sentence each
  /// The solution: rig, wheels, residuals, and the joint covariance of rig and landmarks. If the rig was held, it is
  /// the believed one.
  calibrate::Report solution;
  bool calibrated = false;  ///< Settings::calibrates
  Bounds bounds;            ///< of the runs' map
};

/// Surveys the landmarks of a room. The world is that of the first run's start pose, as far as the wheels know it: its
/// first frame is where they say, exactly. The way to that frame is some centimetres long, and its error is no error of
/// the map.
///
/// A rough map (apps/survey/rough_map.h) is the start. Then the landmarks' outlines are measured in the chosen frames
/// where they are expected, and places, tops, radii, poses and, on request, the rig are solved together
/// (vision/calibration.h), until the result settles. Radii follow from the widths of outlines. No ground truth is read.
///
/// With a measured map, that map is the world. The survey is laid onto it, landmarks that were moved are found
/// (apps/survey/refine.h), and all is solved once more, where what the map states of the others counts with its sigmas.
/// @param runs at least one; all of this robot in one room
/// Errors, each in one line: kUnavailable (built without Ceres), kBadData (images, wheels, too few landmarks,
/// contradictory data, a distance between landmarks that were not found, a measured map of another room).
Result<Report> survey(const std::vector<runlog::RunData>& runs, const config::Robot& robot, const Settings& settings);

/// Returns the table for a terminal: at most 100 columns, in millimetres.
std::string table(const Report& report);

/// Returns MAP.survey.json: the landmarks with their 95 % ellipses, how well they agree with what was seen, and the
/// joint covariance of rig and landmarks (config::Calibration), in SI units and pixels.
std::string to_json(const Report& report);

/// Returns a stand-alone SVG figure: the landmarks from above, with their ellipses enlarged, and the robot's path.
std::string figure(const Report& report);

}  // namespace twocone::survey

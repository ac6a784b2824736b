// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/files/robot_file.h"
#include "apps/runs/run_data.h"
#include "hal/result.h"
#include "vision/calibration.h"
#include "vision/rig_circles.h"

namespace twocone::calibrate {

struct Settings {
  int frames = 90;  ///< spread evenly over the runs, each of which gives by its length; >= 4
  vision::CalibrationPriors priors{};
  bool fit_distortion = false;
  bool leave_out_unreadable = false;  ///< pictures that cannot be read are no error, their frames tell nothing
  bool fit_timing = false;            ///< also latency, skew and readout (vision::CalibrationProblem::fit_timing)
  /// Told about the work: fraction done in [0, 1]. May be empty.
  std::function<void(double)> progress;
};

/// What the pictures of one view tell by themselves.
struct ViewCircles {
  std::optional<vision::RimMeasurement> rim;  ///< goes into the solution
  std::optional<vision::TipMeasurement> tip;  ///< a check
};

struct Report {
  std::vector<std::string> runs;
  std::string robot;  ///< file whose rig was calibrated
  vision::CalibrationResult result;
  vision::CalibrationProblem problem;  ///< of the last round; `result.residuals` points into its frames
  std::array<ViewCircles, 2> circles;  ///< lower, upper
  vision::Rig before, after;
  files::Rig rig;                            ///< `after` for a robot file
  files::Drive drive;                        ///< with the wheels' new sizes
  double slip = 0;                           ///< what was believed of the wheels
  int rounds = 0;                            ///< of sighting and solving
  bool is_settled = false;                   ///< the last round moved no number by more than a third of its sigma
  std::size_t sightings_without_answer = 0;  ///< landmarks times views that gave no sighting
};

/// Finds the errors of `robot`'s rig from runs among known landmarks.
///
/// Each chosen frame's landmarks are sighted (vision/full_ranging.h) under the believed rig; vision/calibration.h
/// solves; as an outline's place leans a little on the rig, all is sighted anew under the answer and solved again, from
/// the same beliefs. Rims come from the median over frames. No ground truth is read.
/// @param runs at least one; all of this robot: cameras of one size
/// Errors: kUnavailable (built without Ceres), kBadData (pictures; too few frames or landmarks; contradictions), each
/// one line. @throws files::FileError for a rig that the method cannot use, std::invalid_argument for settings
Result<Report> calibrate(const std::vector<runs::RunData>& runs, const files::Robot& robot, const Settings& settings);

/// `rig` and `drive` of the report's robot by another solution of `report.problem`. @param result with kOk
void take(const vision::CalibrationResult& result, const files::Robot& robot, Report& report);

/// How the body moved until a row of run.frames, by the wheels' believed sizes and their readings there and at the row
/// before: a picture is of before its stamp, if anything. Nothing at the first, and where readings are missing.
std::optional<vision::BodyTwist> twist_at(const runs::RunData& run, std::size_t row);

/// The rows of run.frames that a calibration of this run alone looks at.
std::vector<std::size_t> chosen_rows(std::size_t frames, int wanted);

/// For a terminal: at most 100 columns, millimetres, degrees and pixels.
std::string table(const Report& report);

/// calibration.json: all of the table in SI units and pixels, by name.
std::string to_json(const Report& report);

/// A picture: for each view the sightings' residuals before and after, drawn as arrows where they are in the mirror.
/// Stand-alone SVG.
std::string residual_figure(const Report& report, vision::Side side);

}  // namespace twocone::calibrate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"
#include "hal/result.h"
#include "vision/calibration.h"
#include "vision/rim.h"

namespace twocone::calibrate {

struct Settings {
  int frames = 90;  ///< spread evenly over the runs in proportion to their length; >= 4
  vision::CalibrationPriors priors{};
  bool fit_distortion = false;
  bool leave_out_unreadable = false;  ///< an unreadable image is no error; its frame gives no sightings
  bool fit_timing = false;            ///< also latency, skew and readout (vision::CalibrationProblem::fit_timing)
  /// Called with the fraction of the work that is done, in [0, 1]. May be empty.
  std::function<void(double)> progress;
};

/// Measurements from the images of one view alone, without a rig.
struct ViewCircles {
  std::optional<vision::RimMeasurement> rim;  ///< used in the solution
  std::optional<vision::TipMeasurement> tip;  ///< only a check
};

struct Report {
  std::vector<std::string> runs;
  std::string robot;  ///< the file of the calibrated rig
  vision::CalibrationResult result{};
  vision::CalibrationProblem problem;    ///< of the last round; `result.residuals` points into its frames
  std::array<ViewCircles, 2> circles{};  ///< lower, upper
  vision::Rig before, after;
  config::Rig rig;          ///< `after` for a robot file
  config::Drive drive;      ///< with the new sizes of the wheels
  double slip = 0;          ///< of the wheels, as believed
  int rounds = 0;           ///< number of rounds of sighting and solving
  bool is_settled = false;  ///< the last round moved no number by more than a third of its sigma
};

/// Finds the errors of `robot`'s rig from runs among known landmarks.
///
/// It sights the landmarks of each chosen frame (vision/outline_ranging.h) with the believed rig and solves
/// (vision/calibration.h). The place of an outline depends slightly on the rig. So it sights again with the new rig and
/// solves again, from the same prior. Rims come from the median over frames. No ground truth is read.
/// @param runs at least one; all of this robot, with cameras of one size
/// Errors: kUnavailable (built without Ceres), kBadData (images; too few frames or landmarks; contradictions), each one
/// line. @throws config::FileError for a rig that the method cannot use, std::invalid_argument for bad settings
Result<Report> calibrate(const std::vector<runlog::RunData>& runs, const config::Robot& robot,
                         const Settings& settings);

/// Replaces the report's rig and drive with another solution of `report.problem`. @param result with kOk
void take(const vision::CalibrationResult& result, const config::Robot& robot, Report& report);

// ---- frames and what is sighted in them

/// Returns the motion of the body before a row of run.frames, from the wheels' believed sizes and their readings at
/// this row and the row before. An image is never newer than its stamp. Returns nothing for the first row or if
/// readings are missing.
std::optional<vision::BodyTwist> twist_at(const runlog::RunData& run, std::size_t row);

/// Returns the rows of run.frames that a calibration of this run alone uses.
std::vector<std::size_t> chosen_rows(std::size_t frames, int wanted);

/// The frames of several runs that a calibration uses.
struct ChosenFrames {
  struct Frame {
    const runlog::RunData* run;
    std::size_t row;                           ///< of run->frames
    std::size_t first_landmark;                ///< index in `landmarks` of the first landmark of the run's map
    std::vector<vision::WheelReading> wheels;  ///< since the previous chosen frame, as in CalibrationFrame
  };
  std::vector<Frame> frames;
  std::vector<Landmark> landmarks;  ///< of the maps of all runs, run by run
};

/// Chooses about `count` frames, spread evenly from the first to the last of each run.
ChosenFrames choose_frames(const std::vector<runlog::RunData>& runs, int count);

// ---- output

/// Returns the table for a terminal: at most 100 columns, in millimetres, degrees and pixels.
std::string table(const Report& report);

/// Returns calibration.json: all of the table in SI units and pixels, by name.
std::string to_json(const Report& report);

/// Returns a stand-alone SVG figure of one view. Arrows at the sightings show their residuals before and after.
std::string residual_figure(const Report& report, vision::Side side);

}  // namespace twocone::calibrate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/config/robot_file.h"
#include "apps/estimation/self_rig.h"
#include "apps/runlog/run_data.h"
#include "hal/result.h"
#include "vision/calibration.h"
#include "vision/rim.h"

namespace twocone::calibrate {

struct Settings {
  int frames = 90;  ///< number of frames, >= 4; evenly spread over the runs in proportion to their length
  vision::CalibrationPriors priors{};
  bool fit_distortion = false;
  bool leave_out_unreadable = false;  ///< true: an unreadable image is no error, and its frame gives no sightings
  /// Starts from what the images show (vision/self_rig.h) where they contradict the robot file. False: from the file.
  bool start_from_images = true;
  /// Called with the fraction of the work that is done, in [0, 1]. May be empty.
  std::function<void(double)> progress;
};

/// Measurements from the images of one view alone. The believed rig serves only as their start.
struct ViewCircles {
  std::optional<vision::RimMeasurement> rim;  ///< used in the solution
  std::optional<vision::TipMeasurement> tip;  ///< not used in the solution, only shown as a check
};

struct Report {
  std::vector<std::string> runs;
  std::string robot;  ///< the file of the calibrated rig
  vision::CalibrationResult result{};
  vision::CalibrationProblem problem;    ///< of the last round; `result.residuals` points into its frames
  std::array<ViewCircles, 2> circles{};  ///< lower, upper
  /// What the images show before anything is believed; empty without Settings::start_from_images.
  std::optional<vision::SelfRig> found{};
  std::vector<estimation::RigDifference> replaced{};  ///< numbers of the robot file that the images contradict
  vision::Rig before, after;    ///< `before` is the start: the robot file's rig with the replaced numbers
  config::Rig rig;              ///< `after` in the form of a robot file
  config::Drive drive;          ///< with the calibrated sizes of the wheels
  double slip = 0;              ///< believed slip of the wheels
  config::RigSigma believed{};  ///< the robot file's, which the times keep where a drive does not show them
  int rounds = 0;               ///< number of rounds of sighting and solving
  bool exchanged = false;       ///< the cameras of the run are exchanged; `rig` is that of the mirrors
  bool has_one_map = false;     ///< all runs are on maps with the same landmarks
  bool is_settled = false;      ///< whether the last round moved no number by more than 0.3 of its sigma
};

/// Finds the errors of `robot`'s rig from runs among known landmarks.
///
/// It starts from the images of the first run alone (vision/self_rig.h): numbers in pixels and azimuths that they
/// contradict, or that the robot file leaves to them, are replaced; mirrored images and exchanged cameras are found.
/// Where the images do not show all of these, the start is the robot file, and an error names what to change.
///
/// It measures the landmarks' sightings in each chosen frame with the believed rig (vision/outline_ranging.h), and
/// solves for the rig and its times of exposure (vision/calibration.h). The place of an outline depends slightly on the
/// rig. So both steps are repeated with the new rig, from the same prior, until the result settles. Rims are measured
/// in the median image over frames. No ground truth is read.
/// @param runs at least one; all of this robot, with images of the size in the robot file
/// Errors, each in one line: kUnavailable (built without Ceres), kBadData (bad images; too few frames or landmarks;
/// contradictory data). @throws config::FileError for a rig that the method cannot use, std::invalid_argument without
/// a run and for settings outside their domain
Result<Report> calibrate(const std::vector<runlog::RunData>& runs, const config::Robot& robot,
                         const Settings& settings);

/// Returns the priors that follow from the standard deviations in the robot file. Numbers that the file states as
/// exact, or not at all, have the priors of vision::CalibrationPriors, and times of exposure a ruler's
/// (config::ruler_sigma): a calibration asks the images.
vision::CalibrationPriors priors_of(const config::Robot& robot);

/// Returns the landmarks as they were found, with their standard deviations.
std::vector<Landmark> found_landmarks(const vision::CalibrationResult& result);

/// Returns the landmarks of the only map of all runs, as calibrated, with their standard deviations; empty where the
/// map is exact or the runs have several maps.
std::vector<Landmark> refined_landmarks(const Report& report);

/// Replaces the report's rig and drive with another solution of `report.problem`. @param result must have verdict kOk
void take(const vision::CalibrationResult& result, const config::Robot& robot, Report& report);

// ---- the frames that a calibration uses

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
  bool exchanged = false;           ///< the run's folder `lower` has the images of the upper mirror
};

/// Chooses about `count` frames, spread evenly over each run from its row `first` to its last.
ChosenFrames choose_frames(const std::vector<runlog::RunData>& runs, int count, std::size_t first = 0);

/// The sightings of the landmarks in the chosen frames.
struct Sighted {
  std::vector<vision::CalibrationFrame> frames;
  std::vector<Error> unreadable;  ///< errors of images; their frames have no sightings
};

/// Measures the landmarks in the chosen frames with `rig`.
/// @param landmarks those of `chosen`, with the tops and radii to measure with
/// @param found what is not known exactly of rig and landmarks; empty: the uncertainties of `robot` and of each run's
/// map
/// @param poses of `chosen.frames`, in which landmarks are expected at their places: x m, y m, heading rad in the
/// world. Without an entry, a landmark's colour identifies it.
/// @throws config::FileError for landmarks that the method cannot measure
Sighted sight(const std::vector<runlog::RunData>& runs, const ChosenFrames& chosen, const vision::Rig& rig,
              const std::vector<Landmark>& landmarks, const config::Robot& robot,
              const std::optional<vision::BeliefErrors>& found,
              const std::vector<std::optional<Eigen::Vector3d>>& poses, const std::function<void(double)>& progress);

/// Returns the wheels as a calibration believes them.
vision::WheelBelief wheels_of(const config::Robot& robot);

/// Measures rim and tip of both mirrors in the median images of the chosen frames.
void measure_circles(const ChosenFrames& chosen, const vision::Rig& rig, std::array<ViewCircles, 2>& circles);

// ---- output

/// Returns the table for a terminal: at most 100 columns, in millimetres, degrees and pixels.
std::string table(const Report& report);

/// Returns calibration.json: everything in the table, by name, in SI units and pixels.
std::string to_json(const Report& report);

/// Returns a stand-alone SVG figure of one view. Arrows at the sightings show the residuals before and after the
/// calibration.
std::string residual_figure(const Report& report, vision::Side side);

}  // namespace twocone::calibrate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "apps/calibrate/calibrate.h"
#include "apps/runlog/run_data.h"
#include "hal/result.h"
#include "vision/mirror_view.h"

namespace twocone::compare {

/// One of the two runs, with the measurements of its robot from its own data. Ground truth enters only `reference`.
struct Side {
  std::string name;     ///< the folder, as the command named it
  runlog::RunData run;  ///< frames, wheels and poses; ranges and sightings are read where they are needed
  std::string method;   ///< method of the ranges and fixes that are compared; empty: those in the run folder itself
  /// None where the drive does not determine it; then `why_no_calibration` states the reason.
  std::optional<calibrate::Report> calibration{};
  std::string why_no_calibration{};
  int chosen = 0;  ///< frames chosen for the calibration
  /// Shifts of landmarks against the others, by name, for the landmarks in the calibration's frames.
  std::map<std::string, vision::RelativeShift> map_shifts{};
  std::vector<std::string> left_out{};  ///< data of the run that are not used, a sentence each
  vision::Rig believed;                 ///< `rig:`
  vision::Rig found;                    ///< rig of the calibration; without one, the believed rig
  /// Pose of the robot at each frame.
  std::vector<std::optional<runlog::PoseRow>> reference{};
  std::string reference_is{};       ///< truth, given trajectory, estimate
  bool is_reference_apart = false;  ///< the reference does not come from the run's own images
};

inline constexpr double kDegree = std::numbers::pi / 180;
/// Prior standard deviation of a landmark's place about its place in the map.
constexpr double kMapSigma_m = 0.02;

/// Reads a run. @param poses given trajectory (TUM, the run's clock); empty: none
/// Errors: kBadData (the run cannot be compared, one line). @throws config::FileError as read_run
Result<Side> read_side(const std::filesystem::path& folder, const std::filesystem::path& poses);

/// Calibrates the rig from the run's own data, with timing and the landmarks' places among the unknowns.
/// @param frames that the calibration uses. @param progress fraction done. May be empty
void calibrate_side(Side& side, int frames, const std::function<void(double)>& progress);

}  // namespace twocone::compare

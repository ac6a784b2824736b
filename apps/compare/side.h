// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/calibrate/calibrate.h"
#include "apps/runs/run_data.h"
#include "hal/result.h"
#include "vision/mirror_view.h"

namespace twocone::compare {

/// One of the two runs, with what its own data tell of its robot. No ground truth goes into it but into `reference`.
struct Side {
  std::string name;    ///< the folder as it was named
  runs::RunData run;   ///< frames, wheels and poses; ranges and sightings are read where they are wanted
  std::string method;  ///< whose ranges and fixes are compared; empty: those on top
  /// None: what the drive shows does not carry it, and `why_no_calibration` says why.
  std::optional<calibrate::Report> calibration;
  std::string why_no_calibration;
  int chosen = 0;  ///< frames that the calibration was to look at
  /// Landmarks against the others, by name; of those that the calibration's frames show.
  std::vector<std::pair<std::string, vision::RelativeShift>> map_shifts;
  std::vector<std::string> left_out;  ///< what of the run was not taken, a sentence each
  vision::Rig believed;               ///< `rig:`
  vision::Rig found;                  ///< of the calibration; without it as believed
  /// At the frames: where it was, and what says so.
  std::vector<std::optional<runs::PoseRow>> reference;
  std::string reference_is;         ///< truth, given trajectory, estimate
  bool is_reference_apart = false;  ///< the reference does not come from the run's own pictures
};

/// How far a landmark may be from where the map has it, before the data speak.
constexpr double kMapSigma_m = 0.02;

/// Reads a run. @param poses given trajectory (TUM, the run's clock); empty: none
/// Errors: kBadData: nothing that can be compared, one line. @throws files::FileError as read_run
Result<Side> read_side(const std::filesystem::path& folder, const std::filesystem::path& poses);

/// Finds what the run tells of its rig, with timing and the landmarks' places among the unknowns.
/// @param frames that the calibration looks at @param progress fraction done. May be empty
void calibrate_side(Side& side, int frames, const std::function<void(double)>& progress);

}  // namespace twocone::compare

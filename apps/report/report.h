// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/runs/run_data.h"
#include "drivers/sim_povray/sim_povray.h"
#include "hal/result.h"

namespace twocone::report {

struct ReportSettings {
  std::string gnuplot = "gnuplot";                    ///< the program: a path, or a name looked up in PATH
  std::chrono::milliseconds gnuplot_timeout{30'000};  ///< for one figure, > 0
  /// A picture of the arena from above is rendered where run and machine allow it; false: a plan is drawn at once.
  bool overhead = true;
  sim_povray::RenderSettings render;  ///< how that picture is rendered
  int budget_draws = 400;             ///< of the error budget's Monte Carlo, for each of its lines, >= 1
  int budget_pose_step = 15;          ///< it stands on every so many frames' poses, >= 1
  /// Told about each step: fraction done in [0, 1], what comes next. May be empty.
  std::function<void(double, std::string_view)> progress;
};

struct ReportResult {
  std::filesystem::path html;
  std::vector<std::string> notes;  ///< what the report had to do without, a sentence each; also in the report itself
};

/// Writes figures/*.svg (with the gnuplot scripts that drew them) and report.html into `run.folder`, each file whole
/// or not at all. report.html needs no other file and no network. Equal runs give equal bytes.
///
/// Runs that were cut off, that have one frame or none, no ground truth, no pictures or landmarks never seen give a
/// report of what there is, with a note of what there is not.
///
/// Errors: kUnavailable (no gnuplot, or a file that cannot be written). A single figure that fails is a note.
/// @throws std::invalid_argument for a timeout, draws or step that are not positive, or a folder that does not exist
Result<ReportResult> write_report(const runs::RunData& run, const ReportSettings& settings = {});

}  // namespace twocone::report

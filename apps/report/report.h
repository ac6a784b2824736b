// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "apps/runlog/run_data.h"
#include "hal/result.h"

namespace twocone::report {

struct ReportSettings {
  std::string gnuplot = "gnuplot";  ///< the program: a path, or a name looked up in PATH
  int error_budget_draws = 400;     ///< draws of the error budget's Monte Carlo for each of its lines, >= 1
  int error_budget_pose_step = 15;  ///< the error budget uses the pose of every such frame, >= 1
  /// Called before each step with the fraction done, in [0, 1].
  std::function<void(double)> progress = [](double) {};
};

struct ReportResult {
  std::filesystem::path html;
  std::vector<std::string> notes;  ///< what is missing from the report, a sentence each; also in the report itself
};

/// Writes figures/*.svg, with the gnuplot scripts that drew them, and report.html into `run.folder`. Each file is
/// written completely or not at all. report.html needs no other file and no network. Equal runs give equal bytes.
///
/// A run that was cut off, has at most one frame, no ground truth, no images, or landmarks that were never seen gives a
/// report of the data that it has, with a note of the data that are missing.
///
/// Errors: kUnavailable (no gnuplot, or a file that cannot be written). A single figure that fails becomes a note.
/// @throws std::invalid_argument for draws or a step that are not positive, or a folder that does not exist
Result<ReportResult> write_report(const runlog::RunData& run, const ReportSettings& settings = {});

}  // namespace twocone::report

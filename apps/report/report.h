// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/summary/summary.h"
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

/// Returns a run as a table for a terminal: what it was (enough to repeat it), the range to each landmark and the
/// position, each with its coverage, its errors in millimetres, the paper's numbers beside them, and the reasons why
/// frames have no answer. Where the method states them, there follow the headings, the Cramer-Rao bounds with the
/// errors of the same frames, a check of the stated sigmas, and the outliers. The text is plain ASCII of at most 100
/// columns: other characters of names become '?', long names are cut.
///
/// Without ground truth there are no errors, and a line states that.
/// @param baseline results of method `paper` on the same frames, shown beside another method; null: not available
/// @param timing times of vision and localisation; null: unknown, or not to be shown
std::string table(const runlog::Summary& summary, const runlog::RunInfo& info, const config::Robot& robot,
                  const runlog::Summary* baseline = nullptr, const runlog::TimingSummary* timing = nullptr);

/// Returns the table of a run, with method `paper` beside another one where the run has both.
/// @param notes receives why a baseline that exists cannot be read
std::string table_of(const runlog::RunData& run, std::vector<std::string>& notes);

/// Returns the command that makes this run again, its words quoted for a POSIX shell where they need it.
std::string repeat_command(const runlog::RunInfo& info, const config::Robot& robot, const std::string& method);

}  // namespace twocone::report

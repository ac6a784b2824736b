// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/summary/summary.h"
#include "hal/result.h"

namespace twocone::report {

struct ReportSettings {
  int error_budget_draws = 400;     ///< Monte Carlo draws for each line of the error budget, >= 1
  int error_budget_pose_step = 15;  ///< step between the frames whose poses the error budget uses, >= 1
  /// Called before each step with the fraction done, in [0, 1].
  std::function<void(double)> progress = [](double) {};
};

struct ReportResult {
  std::filesystem::path html;
  std::vector<std::string> notes;  ///< missing parts of the report, a sentence each; the report contains them too
};

/// Writes report.html into `run.folder`, completely or not at all. The page needs no other file and no network. Equal
/// runs give equal bytes. An image of the arena from above is kept as figures/overhead.png.
///
/// A run may be incomplete: cut off, with at most one frame, without ground truth or images, or with landmarks that
/// were never seen. Its report shows the data that it has, and notes the data that are missing.
///
/// Errors: kUnavailable (the file cannot be written).
/// @throws std::invalid_argument for draws or a step that are not positive, or a folder that does not exist
Result<ReportResult> write_report(const runlog::RunData& run, const ReportSettings& settings = {});

/// Returns the data of that page (web::document), whose notes are in `notes`. @throws as write_report()
nlohmann::ordered_json report_json(const runlog::RunData& run, const ReportSettings& settings = {});

/// Returns the results of a run as a table for a terminal. The table begins with the settings that repeat the run. It
/// shows the range to each landmark and the position, with coverage, errors in millimetres, the paper's numbers and the
/// reasons why frames have no answer. If the method states them, it also shows headings, Cramer-Rao bounds with the
/// errors of the same frames, a check of the stated sigmas, and outliers. The text is plain ASCII of at most 100
/// columns: other characters of names become '?', and long names are cut.
///
/// Without ground truth the table has no errors, and a line states this.
/// @param baseline results of method `paper` on the same frames, shown beside another method; null: not available
/// @param timing times of vision and localisation; null: not shown
std::string table(const runlog::Summary& summary, const runlog::RunInfo& info, const config::Robot& robot,
                  const runlog::Summary* baseline = nullptr, const runlog::TimingSummary* timing = nullptr);

/// Returns the table of a run. If the run has results of method `paper` and of another method, both are shown.
/// @param notes receives the reason if a baseline exists but cannot be read
std::string table_of(const runlog::RunData& run, std::vector<std::string>& notes);

/// Returns the command that repeats this run. Words are quoted for a POSIX shell if necessary.
std::string repeat_command(const runlog::RunInfo& info, const config::Robot& robot, const std::string& method);

}  // namespace twocone::report

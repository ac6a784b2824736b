// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/summary/summary.h"
#include "apps/runlog/summary/timing.h"

namespace twocone::report {

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

/// Returns the summary of method `paper` on the same frames, if the run has one and `run` is of another method. A
/// baseline that exists and cannot be read becomes a note.
std::optional<runlog::Summary> baseline_of(const runlog::RunData& run, std::vector<std::string>& notes);

/// Returns the table of a run, beside method `paper` where baseline_of() has it.
std::string table_of(const runlog::RunData& run, std::vector<std::string>& notes);

/// Returns whether the method states sigmas, or bounds of its errors are known.
bool has_bounds(const runlog::Summary& summary);

/// Returns whether the summary was made with ground truth.
bool has_truth(const runlog::Summary& summary);

/// Returns the verdicts that occur with their counts: `ok` first, then the others by frequency.
std::vector<std::pair<std::string, int>> by_frequency(const std::map<std::string, int>& verdicts);

/// Returns the mean, the root mean square, the 95 % limit and the largest of the errors, in millimetres.
std::array<std::optional<double>, 4> errors_mm(const std::optional<runlog::ErrorStatistics>& error);

/// Returns the summary of the landmark called `name`; an empty one if there is none.
const runlog::LandmarkSummary& landmark_of(const runlog::Summary& summary, const std::string& name);

/// Returns rate, skew and losses of a real robot's pairs of images, in words for a line that may be broken between
/// them.
std::vector<std::string> capture_words(const runlog::CaptureSummary& capture);

/// Returns the times of vision and localisation, in words likewise. They hold for one machine and one run on it.
std::vector<std::string> timing_words(const runlog::TimingSummary& timing);

/// Returns the command that makes this run again, its words quoted for a POSIX shell where they need it.
std::string repeat_command(const runlog::RunInfo& info, const config::Robot& robot, const std::string& method);

/// Returns the colour of a verdict, the same in every figure and table.
std::string verdict_colour(std::string_view verdict);

/// Returns the meaning of a verdict of that method in plain words; empty for an unknown verdict.
std::string_view verdict_meaning(std::string_view verdict, std::string_view method);

}  // namespace twocone::report

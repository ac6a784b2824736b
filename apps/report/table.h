// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/files/robot_file.h"
#include "apps/runs/effort.h"
#include "apps/runs/run_data.h"
#include "apps/runs/summary.h"

namespace twocone::report {

/// A run as a table for a terminal: what it was (enough to repeat it), the range to each pillar and the position, each
/// with its coverage, its errors in millimetres, the paper's figures beside them, and why frames have no answer. Then,
/// where the method states them, headings, the Cramer-Rao bounds with the errors of the same frames, whether the stated
/// sigmas are true, and what was left out as an outlier.
/// At most 100 columns of plain ASCII: other characters of names become '?', long names are cut.
///
/// Without ground truth there are no errors, and a line says so.
/// @param baseline of method `paper` on the same frames, put beside a method of ours; null: not there
/// @param effort what looking and locating took; null: not known, or not to be said
std::string table(const runs::Summary& summary, const runs::RunInfo& info, const files::Robot& robot,
                  const runs::Summary* baseline = nullptr, const runs::EffortSummary* effort = nullptr);

/// The summary of method `paper` on the same frames, if they were measured by it too and `run` is of another method.
/// What is there and cannot be read becomes a note.
std::optional<runs::Summary> baseline_of(const runs::RunData& run, std::vector<std::string>& notes);

/// The table of a run, beside method `paper` where baseline_of() has it.
std::string table_of(const runs::RunData& run, std::vector<std::string>& notes);

/// The method states sigmas, or bounds of its errors are known.
bool has_bounds(const runs::Summary& summary);

/// The summary was made with ground truth at hand.
bool has_truth(const runs::Summary& summary);

/// Frames with that verdict; 0 if it does not occur.
int count_of(const std::map<std::string, int>& verdicts, const std::string& verdict);

/// The summary of the landmark called `name`; null if there is none.
const runs::LandmarkSummary* find_landmark(const runs::Summary* summary, const std::string& name);

/// How a real robot's pairs came, in words for a line that may be broken between them.
std::vector<std::string> capture_words(const runs::CaptureSummary& capture);

/// What looking and locating took, likewise. The times are of one machine and one run of it.
std::vector<std::string> effort_words(const runs::EffortSummary& effort);

/// A word as a POSIX shell wants it: as it is, or in quotes where it needs them.
std::string shell_word(const std::string& word);

/// The command that makes this run again, its words quoted for a POSIX shell where they need it.
std::string repeat_command(const runs::RunInfo& info, const files::Robot& robot, const std::string& method);

}  // namespace twocone::report

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/files/robot_file.h"
#include "apps/runs/run_data.h"
#include "apps/runs/summary.h"

namespace twocone::report {

/// A run as a table for a terminal: what it was (enough to repeat it), the range to each pillar and the position, each
/// with its coverage, its errors in millimetres, the paper's figures beside them, and why frames have no answer.
/// At most 100 columns of plain ASCII: other characters of names become '?', long names are cut.
///
/// Without ground truth there are no errors, and a line says so.
/// @param baseline of method `paper` on the same frames, put beside a method of ours; null: not there
std::string table(const runs::Summary& summary, const runs::RunInfo& info, const files::Robot& robot,
                  const runs::Summary* baseline = nullptr);

/// The summary was made with ground truth at hand.
bool has_truth(const runs::Summary& summary);

/// Frames with that verdict; 0 if it does not occur.
int count_of(const std::map<std::string, int>& verdicts, const std::string& verdict);

/// The summary of the landmark called `name`; null if there is none.
const runs::LandmarkSummary* find_landmark(const runs::Summary* summary, const std::string& name);

/// The command that makes this run again, its words quoted for a POSIX shell where they need it.
std::string repeat_command(const runs::RunInfo& info, const files::Robot& robot, const std::string& method);

}  // namespace twocone::report

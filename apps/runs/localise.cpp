// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/files/file_error.h"
#include "apps/runs/effort.h"
#include "apps/runs/run.h"
#include "apps/runs/summary.h"
#include "apps/runs/track.h"

namespace twocone::runs {

Result<RunData> localise(const std::filesystem::path& folder, Method method, const Progress& progress) {
  RunData run = read_run(folder);
  const Estimator estimator(method, run.robot, run.map);
  Track track(method, run.robot);
  if (has_odometry(run) && run.drive.size() < run.frames.size()) {
    throw files::FileError(fmt::format("{}: frames.csv has {} frames, but drive.csv {}", folder.string(),
                                       run.frames.size(), run.drive.size()));
  }
  std::vector<AnswerRows> answers;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const FrameRow& frame = run.frames[i];
    const auto lower = read_picture(lower_picture(folder, frame.frame));
    if (!lower) return lower.error();
    const auto upper = read_picture(upper_picture(folder, frame.frame));
    if (!upper) return upper.error();
    const auto answer = estimator.answer(*lower, *upper);
    if (!answer) return Error{answer.error().code, fmt::format("frame {}: {}", frame.frame, answer.error().message)};
    answers.push_back(to_rows(frame.frame, frame.t_s, *answer, run.map, run.truth.empty() ? nullptr : &run.truth[i]));
    answers.back().effort = to_row(frame.frame, frame.t_s, answer->effort, budget_of(method, run.robot).has_value());
    answers.back().track = has_odometry(run) ? track.follow(frame.frame, run.drive[i], run.odometry[i], answer->fix)
                                             : track_row(frame.frame, frame.t_s, answer->fix);
    progress(double(i + 1) / double(run.frames.size()));
  }
  const std::string name(to_string(method));
  write_results(folder, name, answers, OnTop::kYes);
  RunData again = read_run(folder, name);
  write_summary_of(again, OnTop::kYes);
  return again;
}

void write_summary_of(const RunData& run, OnTop on_top) {
  write_summary(run.folder, run.method, to_json(summarise(run), run.info), on_top);
}

}  // namespace twocone::runs

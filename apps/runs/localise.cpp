// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/config/yaml/file_error.h"
#include "apps/estimation/track.h"
#include "apps/runlog/run_yaml.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/runlog/summary/timing.h"
#include "apps/runs/run.h"

namespace twocone::runs {
namespace {

// In place of a verdict: nothing was looked at.
constexpr const char* kNoImage = "no_image";

/// A frame's two images; none: one cannot be read, and that is allowed.
struct Pair {
  Image lower, upper;
};

Result<std::optional<Pair>> read_pair(const std::filesystem::path& folder, std::uint64_t frame, bool allow_missing) {
  const auto without = [&](const Error& error) -> Result<std::optional<Pair>> {
    if (allow_missing) return std::optional<Pair>();
    return Error{error.code, fmt::format("frame {}: {}; nothing was changed: put the image back, or leave such frames "
                                         "without an answer with --allow-missing",
                                         frame, error.message)};
  };
  auto lower = runlog::read_image(runlog::lower_image_file(folder, frame));
  if (!lower) return without(lower.error());
  auto upper = runlog::read_image(runlog::upper_image_file(folder, frame));
  if (!upper) return without(upper.error());
  return std::optional(Pair{*std::move(lower), *std::move(upper)});
}

runlog::AnswerRows no_image_rows(const runlog::FrameRow& frame, const config::Map& map, const runlog::PoseRow* truth) {
  estimation::FrameAnswer none;
  none.ranges.resize(map.landmarks.size());
  runlog::AnswerRows rows = runlog::to_rows(frame.frame, frame.t_s, none, map, truth);
  for (runlog::RangeRow& row : rows.ranges) row.verdict = kNoImage;
  for (runlog::FixRow& row : rows.fixes) row.verdict = kNoImage;
  return rows;
}

}  // namespace

Result<runlog::RunData> localise(const std::filesystem::path& folder, estimation::Method method,
                                 const Progress& progress, const LocaliseOptions& options) {
  (void)runlog::read_run_yaml(folder);  // no lock in a folder that is no run
  const runlog::RunLock lock(folder);
  const runlog::RunData run = runlog::read_run(folder);
  const estimation::Estimator estimator(method, run.robot, run.map);
  estimation::Track track(method, run.robot);
  if (run.frames.empty()) throw config::FileError("{}: the run has no frame", folder.string());
  runlog::check_drive(run);
  bool is_any_read = false;
  std::vector<runlog::AnswerRows> answers;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    if (options.stop && *options.stop) {
      return Error{ErrorCode::kCancelled, fmt::format("stopped from outside; {} is as it was", folder.string())};
    }
    const runlog::FrameRow& frame = run.frames[i];
    const runlog::PoseRow* const truth = run.truth.empty() ? nullptr : &run.truth[i];
    const auto pair = read_pair(folder, frame.frame, options.allow_missing);
    if (!pair) return pair.error();
    localisation::Fix fix;
    is_any_read = is_any_read || *pair;
    if (*pair) {
      const auto answer = estimator.answer((*pair)->lower, (*pair)->upper);
      if (!answer) return Error{answer.error().code, fmt::format("frame {}: {}", frame.frame, answer.error().message)};
      answers.push_back(runlog::to_rows(frame.frame, frame.t_s, *answer, run.map, truth));
      answers.back().timing = runlog::to_row(frame.frame, frame.t_s, answer->timing,
                                             estimation::time_limit_of(method, run.robot).has_value());
      fix = answer->fix;
    } else {
      answers.push_back(no_image_rows(frame, run.map, truth));
    }
    const runlog::DriveRow* const drive = runlog::has_odometry(run) ? &run.drive[i] : nullptr;
    answers.back().track = runlog::to_row(
        frame.frame, frame.t_s, fix,
        drive ? track.follow(drive->t_s, drive->left_rad, drive->right_rad, run.odometry[i].heading_rad, fix)
              : estimation::track_without_wheels(fix));
    progress(double(i + 1) / double(run.frames.size()));
  }
  if (!is_any_read) {
    return Error{ErrorCode::kNotFound,
                 fmt::format("{}: no frame has both its images; nothing was changed", folder.string())};
  }
  const std::string name(to_string(method));
  runlog::write_results(folder, name, answers, runlog::OnTop::kYes, &run.info);
  return runlog::read_run(folder, name);
}

}  // namespace twocone::runs

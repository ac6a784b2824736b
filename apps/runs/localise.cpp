// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/files/file_error.h"
#include "apps/runs/effort.h"
#include "apps/runs/run.h"
#include "apps/runs/run_lock.h"
#include "apps/runs/run_yaml.h"
#include "apps/runs/summary.h"
#include "apps/runs/track.h"

namespace twocone::runs {
namespace {

// In place of a verdict: nothing was looked at.
constexpr const char* kNoImage = "no_image";

/// A frame's two pictures; none: one cannot be read, and that is allowed.
struct Pair {
  Image lower, upper;
};

class StoredPairs {
 public:
  StoredPairs(const std::filesystem::path& folder, Missing missing) : folder_(folder), missing_(missing) {}

  Result<std::optional<Pair>> read(std::uint64_t frame) {
    auto lower = read_picture(lower_picture(folder_, frame));
    if (!lower) return without(frame, lower.error());
    auto upper = read_picture(upper_picture(folder_, frame));
    if (!upper) return without(frame, upper.error());
    ++read_;
    return std::optional(Pair{*std::move(lower), *std::move(upper)});
  }
  /// Whether any frame could be read.
  [[nodiscard]] bool any() const { return read_ > 0; }

 private:
  [[nodiscard]] Result<std::optional<Pair>> without(std::uint64_t frame, const Error& error) const {
    if (missing_ == Missing::kAllowed) return std::optional<Pair>();
    return Error{error.code, fmt::format("frame {}: {}; nothing was changed: put the image back, or leave such frames "
                                         "without an answer with --allow-missing",
                                         frame, error.message)};
  }

  const std::filesystem::path& folder_;
  Missing missing_;
  int read_ = 0;
};

AnswerRows no_image_rows(const FrameRow& frame, const files::Map& map, const PoseRow* truth) {
  FrameAnswer none;
  none.ranges.resize(map.landmarks.size());
  AnswerRows rows = to_rows(frame.frame, frame.t_s, none, map, truth);
  for (RangeRow& row : rows.ranges) row.verdict = kNoImage;
  for (FixRow& row : rows.fixes) row.verdict = kNoImage;
  return rows;
}

}  // namespace

Result<RunData> localise(const std::filesystem::path& folder, Method method, const Progress& progress,
                         const LocaliseOptions& options) {
  (void)read_run_yaml(folder);  // no lock in a folder that is no run
  const RunLock lock(folder);
  const RunData run = read_run(folder);
  const Estimator estimator(method, run.robot, run.map);
  Track track(method, run.robot);
  if (run.frames.empty()) throw files::FileError(fmt::format("{}: the run has no frame", folder.string()));
  if (has_odometry(run) && run.drive.size() < run.frames.size()) {
    throw files::FileError(fmt::format("{}: frames.csv has {} frames, but drive.csv {}", folder.string(),
                                       run.frames.size(), run.drive.size()));
  }
  StoredPairs pairs(folder, options.missing);
  std::vector<AnswerRows> answers;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    if (options.stop && *options.stop) {
      return Error{ErrorCode::kRefused, fmt::format("stopped from outside; {} is as it was", folder.string())};
    }
    const FrameRow& frame = run.frames[i];
    const PoseRow* const truth = run.truth.empty() ? nullptr : &run.truth[i];
    const auto pair = pairs.read(frame.frame);
    if (!pair) return pair.error();
    localisation::Fix fix;
    if (*pair) {
      const auto answer = estimator.answer((*pair)->lower, (*pair)->upper);
      if (!answer) return Error{answer.error().code, fmt::format("frame {}: {}", frame.frame, answer.error().message)};
      answers.push_back(to_rows(frame.frame, frame.t_s, *answer, run.map, truth));
      answers.back().effort = to_row(frame.frame, frame.t_s, answer->effort, budget_of(method, run.robot).has_value());
      fix = answer->fix;
    } else {
      answers.push_back(no_image_rows(frame, run.map, truth));
    }
    answers.back().track = has_odometry(run) ? track.follow(frame.frame, run.drive[i], run.odometry[i], fix)
                                             : track_row(frame.frame, frame.t_s, fix);
    progress(double(i + 1) / double(run.frames.size()));
  }
  if (!pairs.any()) {
    return Error{ErrorCode::kNotFound,
                 fmt::format("{}: no frame has both its images; nothing was changed", folder.string())};
  }
  const std::string name(to_string(method));
  write_results(folder, name, answers, OnTop::kYes, [&](const std::filesystem::path& results) {
    return to_json(summarise(read_run_with(folder, results, name)), run.info);
  });
  return read_run(folder, name);
}

void write_summary_of(const RunData& run, OnTop on_top) {
  write_summary(run.folder, run.method, to_json(summarise(run), run.info), on_top);
}

}  // namespace twocone::runs

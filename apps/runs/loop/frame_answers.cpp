// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/frame_answers.h"

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/summary/summary.h"

namespace twocone::runs {

using estimation::Method;

FrameAnswers::FrameAnswers(const config::Robot& robot, const config::Map& map, Method method)
    : robot_(robot),
      map_(map),
      chain_{method, estimation::Estimator(method, robot, map), estimation::Track(method, robot, map)} {
  if (method == Method::kPaper) return;
  try {
    baseline_.emplace(Chain{Method::kPaper, estimation::Estimator(Method::kPaper, robot, map),
                            estimation::Track(Method::kPaper, robot, map)});
  } catch (const config::FileError& error) {
    why_no_baseline_ = error.what();
  }
}

Result<localisation::Fix> FrameAnswers::answer(Chain& chain, const Image& lower, const Image& upper,
                                               const runlog::FrameRecord& record, runlog::AnswerRows& rows) const {
  const auto twist = last_drive_ ? runlog::twist_between(robot_, *last_drive_, record.drive) : std::nullopt;
  const auto answer = chain.estimator.answer(lower, upper, vision::frame_motion(twist, record.frame.skew_s));
  if (!answer) return answer.error();
  const std::uint64_t frame = record.frame.frame;
  const double t_s = record.frame.t_s;
  rows = runlog::to_rows(frame, t_s, *answer, map_, record.truth ? &*record.truth : nullptr);
  rows.track = runlog::to_row(frame, record.odometry.t_s, answer->fix,
                              chain.track.follow(record.drive.t_s, record.drive.left_rad, record.drive.right_rad,
                                                 record.odometry.heading_rad, answer->fix));
  rows.timing = runlog::to_row(frame, t_s, answer->timing, estimation::time_limit_of(chain.method, robot_).has_value());
  return answer->fix;
}

Result<localisation::Fix> FrameAnswers::answer(const Image& lower, const Image& upper, runlog::FrameRecord& record) {
  auto fix = answer(chain_, lower, upper, record, record.answer);
  if (!fix) return fix;
  timing_.push_back(*record.answer.timing);
  if (baseline_) {
    const auto baseline = answer(*baseline_, lower, upper, record, baseline_rows_.emplace_back());
    if (!baseline) return baseline.error();
  }
  last_drive_ = record.drive;
  return fix;
}

std::optional<std::string> FrameAnswers::over_budget() const {
  const auto budget_s = estimation::time_limit_of(chain_.method, robot_);
  return budget_s ? runlog::budget_event(timing_, *budget_s) : std::nullopt;
}

}  // namespace twocone::runs

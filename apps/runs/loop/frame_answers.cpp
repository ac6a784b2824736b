// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/frame_answers.h"

#include <utility>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/summary/summary.h"

namespace twocone::runs {

using estimation::Method;

namespace {

// Frames from one entry of the growing map to the next.
constexpr std::uint64_t kMapEvery = 15;

}  // namespace

FrameAnswers::FrameAnswers(const config::Robot& robot, const config::Map& map, Method method, bool maps)
    : robot_(robot), map_(maps ? estimation::without_landmarks(map) : map), method_(method) {
  if (maps) {
    if (robot.estimator.plan) {
      throw config::FileError(
          "{}: estimator.plan: a run that finds its landmarks on the way (--landmarks none) does not use the floor "
          "plan; "
          "leave out one of the two, or use a map with landmarks: []",
          robot.file.string());
    }
    mapping_.emplace(robot, map);
    why_no_baseline_ = "method paper needs a map of landmarks";
    return;
  }
  chain_.emplace(Chain{method, estimation::Estimator(method, robot, map), estimation::Track(method, robot, map)});
  if (method == Method::kPaper) return;
  try {
    baseline_.emplace(Chain{Method::kPaper, estimation::Estimator(Method::kPaper, robot, map),
                            estimation::Track(Method::kPaper, robot, map)});
  } catch (const config::FileError& error) {
    why_no_baseline_ = error.what();
  }
}

std::optional<vision::FrameMotion> FrameAnswers::motion_of(const runlog::FrameRecord& record) const {
  const auto twist = last_drive_ ? runlog::twist_between(robot_, *last_drive_, record.drive) : std::nullopt;
  return vision::frame_motion(twist, record.frame.skew_s);
}

Result<localisation::Fix> FrameAnswers::answer(Chain& chain, const Image& lower, const Image& upper,
                                               runlog::FrameRecord& record, runlog::AnswerRows& rows) const {
  auto answer = chain.estimator.answer(lower, upper, motion_of(record));
  if (!answer) return answer.error();
  const std::uint64_t frame = record.frame.frame;
  const double t_s = record.frame.t_s;
  rows = runlog::to_rows(frame, t_s, *answer, map_, record.truth ? &*record.truth : nullptr);
  rows.track = runlog::to_row(frame, record.odometry.t_s, answer->fix,
                              chain.track.follow(record.drive.t_s, record.drive.left_rad, record.drive.right_rad,
                                                 record.odometry.heading_rad, answer->fix, answer->scan));
  if (!answer->scan.empty()) record.scan = std::move(answer->scan);
  rows.timing = runlog::to_row(frame, t_s, answer->timing, estimation::time_limit_of(chain.method, robot_).has_value());
  return answer->fix;
}

std::vector<estimation::MappedLandmark> FrameAnswers::found() const {
  return mapping_ ? mapping_->landmarks() : std::vector<estimation::MappedLandmark>();
}

Result<std::optional<Eigen::Vector2d>> FrameAnswers::map_on(const Image& lower, const Image& upper,
                                                            runlog::FrameRecord& record) {
  const runlog::DriveRow& drive = record.drive;
  const auto mapped = mapping_->answer(lower, upper, motion_of(record), drive.t_s, drive.left_rad, drive.right_rad);
  if (!mapped) return mapped.error();
  const std::uint64_t frame = record.frame.frame;
  const double t_s = record.frame.t_s;
  record.answer = runlog::to_rows(frame, t_s, {}, map_, record.truth ? &*record.truth : nullptr);  // no fix
  record.answer.track = runlog::to_row(frame, record.odometry.t_s, {}, mapped->track);
  record.answer.timing = runlog::to_row(frame, t_s, mapped->timing, false);
  if (frame % kMapEvery != 0) return mapped->track.position_m;
  for (const estimation::MappedLandmark& found : mapping_->landmarks()) {
    const Landmark& l = found.landmark;
    record.answer.landmarks.push_back({.frame = frame,
                                       .t_s = t_s,
                                       .landmark = found.name,
                                       .x_m = l.x_m,
                                       .y_m = l.y_m,
                                       .top_m = l.top_m,
                                       .radius_m = l.radius_m,
                                       .var_x_m2 = found.place_m2(0, 0),
                                       .cov_xy_m2 = found.place_m2(0, 1),
                                       .var_y_m2 = found.place_m2(1, 1),
                                       .sigma_top_m = l.sigma.top_m,
                                       .sigma_radius_m = l.sigma.radius_m,
                                       .sightings = found.sightings});
  }
  return mapped->track.position_m;
}

Result<std::optional<Eigen::Vector2d>> FrameAnswers::answer(const Image& lower, const Image& upper,
                                                            runlog::FrameRecord& record) {
  std::optional<Eigen::Vector2d> position_m;
  if (mapping_) {
    const auto mapped = map_on(lower, upper, record);
    if (!mapped) return mapped.error();
    position_m = *mapped;
  } else {
    const auto fix = answer(*chain_, lower, upper, record, record.answer);
    if (!fix) return fix.error();
    if (is_place(*fix)) position_m = fix->position_m;
  }
  timing_.push_back(*record.answer.timing);
  if (baseline_) {
    const auto baseline = answer(*baseline_, lower, upper, record, baseline_rows_.emplace_back());
    if (!baseline) return baseline.error();
  }
  last_drive_ = record.drive;
  return position_m;
}

std::optional<std::string> FrameAnswers::over_budget() const {
  const auto budget_s = estimation::time_limit_of(method_, robot_);
  return budget_s ? runlog::budget_event(timing_, *budget_s) : std::nullopt;
}

}  // namespace twocone::runs

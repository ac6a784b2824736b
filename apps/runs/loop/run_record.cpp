// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/run_record.h"

#include <utility>

#include "apps/runlog/run_yaml.h"
#include "apps/runlog/version.h"

namespace twocone::runs {

RunRecord::RunRecord(const config::Robot& robot, const config::Map& map, const RunOptions& options)
    : robot_(robot), map_(map), options_(options) {
  info_.version = runlog::version();
  info_.commit = runlog::commit();
  info_.compiler = runlog::compiler();
  info_.behaviour = options.behaviour;
  info_.method = to_string(options.method);
  info_.seed = options.seed;
  info_.frames_wanted = options.frames;
  info_.truth = options.truth;
}

void RunRecord::open() {
  folder_.emplace(options_.out, options_.old);
  write_yaml();
}

void RunRecord::write_yaml() const { runlog::write_run_yaml(folder_->path(), info_, robot_, map_.file); }

void RunRecord::note(const std::string& event) {
  info_.events.push_back(event);
  if (options_.notify && frames_ >= replayed_) options_.notify(event);
}

void RunRecord::note_later(const std::string& event) {
  const std::lock_guard lock(mutex_);
  later_.push_back(event);
}

std::vector<std::string> RunRecord::take_later() {
  const std::lock_guard lock(mutex_);
  return std::exchange(later_, {});
}

void RunRecord::add(const runlog::FrameRecord& record, const Image& lower, const Image& upper,
                    const std::vector<runlog::OtherImage>& others) {
  folder_->add(record, lower, upper, others);
  ++frames_;
}

void RunRecord::finish(const std::vector<runlog::AnswerRows>& baseline) {
  info_.finished = true;
  if (!baseline.empty()) {
    const std::string paper(to_string(estimation::Method::kPaper));
    runlog::write_results(folder_->path(), paper, baseline, runlog::OnTop::kNo, &info_);
  }
  runlog::file_results(folder_->path(), info_.method, &info_);
  write_yaml();
}

}  // namespace twocone::runs

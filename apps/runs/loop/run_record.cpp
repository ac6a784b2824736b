// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/run_record.h"

#include <utility>

#include <fmt/format.h>

#include "apps/runlog/run_yaml.h"
#include "apps/runlog/summary/summary.h"
#include "apps/runlog/version.h"
#include "base/log.h"

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

RunRecord::~RunRecord() {
  for (const std::string& line : base::close_log()) {
    if (options_.notify) options_.notify(line);
  }
}

void RunRecord::open() {
  folder_.emplace(options_.out, options_.old);
  base::Logger("run").info(fmt::format("{} frames, behaviour {}", options_.frames, options_.behaviour));
  write_yaml();
}

void RunRecord::write_yaml() const { runlog::write_run_yaml(folder_->path(), info_, robot_, map_.file); }

void RunRecord::note(const std::string& event) {
  info_.events.push_back(event);
  base::Logger("run").info(event);
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
  if (frames_ == 1) base::open_log(path() / "run.log");  // before, the folder may still be removed
}

runlog::SummaryOf RunRecord::summary_of(const std::string& method) const {
  return [this, method](const std::filesystem::path& results) {
    return runlog::to_json(runlog::summarise(runlog::read_run_with(folder_->path(), results, method)), info_);
  };
}

void RunRecord::finish(const std::vector<runlog::AnswerRows>& baseline) {
  info_.finished = true;
  if (!baseline.empty()) {
    const std::string paper(to_string(estimation::Method::kPaper));
    runlog::write_results(folder_->path(), paper, baseline, runlog::OnTop::kNo, summary_of(paper));
  }
  runlog::file_results(folder_->path(), info_.method, summary_of(info_.method));
  write_yaml();
}

}  // namespace twocone::runs

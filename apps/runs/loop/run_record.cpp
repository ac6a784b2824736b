// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/run_record.h"

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/estimation/mapping.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/version.h"
#include "base/log.h"

namespace twocone::runs {
namespace {

/// Returns the applied settings for run.yaml, for example "lower: Logi (/dev/video0), MJPG 640 x 480 at 30 Hz, gain
/// 16". Empty: no device.
std::string describe(const std::string& view, const CameraFacts& facts) {
  if (facts.device.empty()) return {};
  const CameraSettings& applied = facts.settings;
  std::string text = fmt::format("{}: {}, {} {} x {} at {:.4g} Hz{}", view, facts.device, facts.format,
                                 applied.width_px, applied.height_px, applied.rate_hz,
                                 facts.has_rate ? "" : " (as requested: the camera does not report it)");
  for (const auto& [name, value] : facts.controls) text += fmt::format(", {} {}", name, value);
  return text;
}

/// Returns for example "drive: /dev/ttyUSB0 at 57600 baud, ros_arduino_bridge, 990 counts a turn, its own time-out 2000
/// ms, guarded". Empty: no device.
std::string describe(const DriveFacts& facts) {
  if (facts.device.empty()) return {};
  std::string text =
      fmt::format("drive: {}, {}, {} counts a turn", facts.device, facts.controller, facts.counts_per_turn);
  text += facts.own_timeout ? fmt::format(", its own time-out {} ms", facts.own_timeout->count())
                            : ", no time-out of its own";
  return text + (facts.has_watchdog ? ", guarded" : ", no watchdog");
}

}  // namespace

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
  info_.real_time = options.real_time;
  info_.maps = options.maps;
  info_.telemetry = options.telemetry;
}

RunRecord::~RunRecord() {
  writer_.reset();
  for (const std::string& line : base::close_log()) {
    if (options_.notify) options_.notify(line);
  }
}

void RunRecord::open() {
  folder_.emplace(options_.out, options_.old);
  if (options_.telemetry) {
    telemetry_.emplace(robot_, options_.maps ? estimation::without_landmarks(map_) : map_);
  }
  writer_.emplace([this](const FinishedFrame& frame) {
    if (telemetry_) add_telemetry(frame.record);
    folder_->add(frame.record, *frame.lower, *frame.upper, frame.others, frame.truth);
  });
  base::Logger("run").info(fmt::format("{} frames, behaviour {}", options_.frames, options_.behaviour));
  write_yaml();
}

void RunRecord::add_telemetry(const runlog::FrameRecord& record) {
  // Times differ when a run is resumed, so its lines may.
  constexpr runlog::Equal kEqual = runlog::Equal::kNot;
  if (!telemetry_file_) {
    telemetry_file_.emplace(path() / "telemetry.jsonl", options_.old);
    const auto sensors = telemetry::sensors_of(robot_, options_.maps);
    telemetry_file_->add(telemetry_->run(path().filename().string(), info_, sensors).dump(), kEqual);
  }
  telemetry_file_->add(telemetry_->frame(record).dump(), kEqual);
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

void RunRecord::note_devices(Robot& robot) {
  if (robot.pace().waits_for_program) return;
  info_.devices = {describe("lower", robot.cameras().lower().facts()),
                   describe("upper", robot.cameras().upper().facts()), describe(robot.drive().facts())};
  std::erase(info_.devices, "");
  info_.capture.emplace();
  write_yaml();
}

void RunRecord::add(FinishedFrame frame) {
  writer_->add(std::move(frame));
  if (++frames_ > 1) return;
  writer_->finish();  // before its first frame, the folder may still be removed
  base::open_log(path() / "run.log");
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

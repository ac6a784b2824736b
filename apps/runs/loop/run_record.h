// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/runlog/run_folder.h"
#include "apps/runs/loop/frame_writer.h"
#include "apps/runs/run.h"
#include "apps/telemetry/telemetry.h"
#include "hal/robot.h"

namespace twocone::runs {

/// Writes the run folder during the run: run.yaml with its events, and the frames.
class RunRecord {
 public:
  RunRecord(const config::Robot& robot, const config::Map& map, const RunOptions& options);
  /// Stores what was added, and closes run.log. If it does not exist, because there was no frame, reports the logged
  /// lines to RunOptions::notify.
  ~RunRecord();

  /// Creates and locks the folder (a resumed run's is only locked) and writes run.yaml. @throws runlog::DiskError
  void open();
  [[nodiscard]] const std::filesystem::path& path() const { return folder_->path(); }
  [[nodiscard]] runlog::RunInfo& info() { return info_; }
  /// @throws runlog::DiskError
  void write_yaml() const;
  /// Writes the devices of a real robot into run.yaml. @throws runlog::DiskError
  void note_devices(Robot& robot);

  /// Adds an event to run.yaml and reports it to RunOptions::notify at once. Events that a resumed run replays were
  /// reported before and are only added to run.yaml.
  void note(const std::string& event);
  /// Stores an event until the run's end. Any thread may call it.
  void note_later(const std::string& event);
  /// Returns and removes the stored events.
  std::vector<std::string> take_later();

  /// Hands a frame over to be stored. @throws runlog::DiskError, also for an earlier frame
  void add(FinishedFrame frame);
  /// Waits until all frames are stored. @throws runlog::DiskError
  void finish_frames() { writer_->finish(); }
  /// Returns the number of frames that were added. After finish_frames(), all of them are stored.
  [[nodiscard]] int frames() const { return frames_; }
  /// Sets the number of frames that a resumed run had stored before.
  void set_replayed(int frames) { replayed_ = frames; }
  [[nodiscard]] int replayed() const { return replayed_; }

  /// Writes the results of both methods. Writes run.yaml with `finished` last, so a finished run has all its results.
  /// @param baseline answers of method paper beside another one; empty: none. @throws runlog::DiskError
  void finish(const std::vector<runlog::AnswerRows>& baseline);

 private:
  void add_telemetry(const runlog::FrameRecord& record);

  const config::Robot& robot_;
  const config::Map& map_;
  const RunOptions& options_;
  runlog::RunInfo info_;
  std::optional<runlog::RunFolder> folder_;
  std::optional<telemetry::Lines> telemetry_;
  std::optional<runlog::LineFile> telemetry_file_;
  std::optional<FrameWriter> writer_;  // its thread uses the members above
  int frames_ = 0;
  int replayed_ = 0;
  std::mutex mutex_;  // of later_
  std::vector<std::string> later_;
};

}  // namespace twocone::runs

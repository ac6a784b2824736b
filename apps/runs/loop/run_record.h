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
#include "apps/runs/run.h"
#include "drivers/backends.h"
#include "drivers/sim_povray/place.h"
#include "hal/robot.h"

namespace twocone::runs {

/// The run folder while the run goes on: run.yaml with its events, and the frames.
class RunRecord {
 public:
  RunRecord(const config::Robot& robot, const config::Map& map, const RunOptions& options);
  /// Closes run.log. Where there is none, because there was no frame, reports what was logged.
  ~RunRecord();

  /// Makes (or, for a resumed run, locks) the folder and writes run.yaml. @throws runlog::DiskError
  void open();
  [[nodiscard]] const std::filesystem::path& path() const { return folder_->path(); }
  [[nodiscard]] runlog::RunInfo& info() { return info_; }
  /// @throws runlog::DiskError
  void write_yaml() const;
  /// Writes what a real robot is made of into run.yaml. @throws runlog::DiskError
  void note_devices(Robot& robot);

  /// An event of the run: into run.yaml, and at once to RunOptions::notify. What a resumed run replays was reported
  /// before and only goes into run.yaml.
  void note(const std::string& event);
  /// The same from any thread; it becomes an event at the run's end.
  void note_later(const std::string& event);
  std::vector<std::string> take_later();

  /// @throws runlog::DiskError
  void add(const runlog::FrameRecord& record, const Image& lower, const Image& upper,
           const std::vector<runlog::OtherImage>& others);
  /// Frames that are wholly written.
  [[nodiscard]] int frames() const { return frames_; }
  /// The first frames of a resumed run, which were there before.
  void set_replayed(int frames) { replayed_ = frames; }

  /// Writes the results of both methods and, last, run.yaml with `finished`, so that a run that says so has all its
  /// results. @param baseline answers of method paper beside another one; empty: none. @throws runlog::DiskError
  void finish(const std::vector<runlog::AnswerRows>& baseline);

 private:
  const config::Robot& robot_;
  const config::Map& map_;
  const RunOptions& options_;
  runlog::RunInfo info_;
  std::optional<runlog::RunFolder> folder_;
  int frames_ = 0;
  int replayed_ = 0;
  std::mutex mutex_;  // of later_
  std::vector<std::string> later_;
};

/// Writes what each mirror pixel really shows (run --truth), as CSV beside the images.
class TruthWriter {
 public:
  /// Errors: kRefused (no simulated world inside this program), and those of sim_povray::claimed_object
  static Result<TruthWriter> open(const config::Robot& robot, const config::Map& map,
                                  const drivers::RobotSettings& settings);

  /// Errors: those of sim_povray::reflected_truth. @throws runlog::DiskError
  [[nodiscard]] Status write(const std::filesystem::path& run, const runlog::FrameRecord& record,
                             const StereoFrame& frame) const;

 private:
  TruthWriter() = default;

  const config::Robot* robot_ = nullptr;
  sim_povray::PlaceSettings place_;
  std::string object_;
  std::string ending_;  ///< of its cameras' names
  std::vector<Landmark> landmarks_;
};

}  // namespace twocone::runs

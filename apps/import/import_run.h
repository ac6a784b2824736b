// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/import/stamps.h"
#include "apps/import/topics.h"

namespace twocone::importer {

/// A recording of another program. All times are of one clock.
struct Recording {
  std::filesystem::path robot_file;    ///< of the recorded robot; its map describes the place
  std::filesystem::path file{};        ///< with all topics (unpack()); empty: the files below
  TopicNames topics{};                 ///< of `file`
  std::filesystem::path lower, upper;  ///< folders of images
  std::filesystem::path lower_times{},
      upper_times{};                   ///< files of their times (list_images); empty: the names are the times
  StampUnit unit = StampUnit::kAuto;   ///< of the images' times
  std::filesystem::path trajectory{};  ///< TUM file of the robot's poses (Trajectory); empty: unknown
  std::filesystem::path odometry{};    ///< CSV file of its wheels (WheelFile); empty: unknown
  std::optional<double> max_skew_s{};  ///< of a pair, > 0, at most a period; none: half of the shorter median period
};

struct Imported {
  std::size_t frames = 0;
  std::vector<std::string> events;  ///< events for run.yaml: what was done and what was left out, one sentence each
};

/// Makes a run folder (docs/file-formats.md) from a recording of another program, for all programs that read runs.
///
/// A recording of one file is unpacked into a folder beside `out`, which is removed again. The lenses of its cameras,
/// if it has them, are kept as lower_camera_info.yaml and upper_camera_info.yaml in the run folder.
///
/// pair_images() finds the pairs. A frame's time is that of the lower image, relative to the first frame. Frames that a
/// given trajectory or odometry does not cover are left out. Wheel angles are interpolated at the frame's time, and
/// odometry.tum is computed from them, from the robot file's start. Without odometry, drive.csv and odometry.tum are
/// empty. The trajectory becomes truth.tum. The commands and the clock of the recording machine are unknown and give
/// empty fields.
///
/// An image that cannot be decoded is left out if it is the last of its folder, because the recording may have been cut
/// off there. A failure leaves no run.
/// @param out empty or not yet existing
/// @throws config::FileError, runlog::DiskError
Imported import_run(const Recording& recording, const std::filesystem::path& out,
                    const std::function<void(double done)>& progress);

}  // namespace twocone::importer

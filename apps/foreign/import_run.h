// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/foreign/stamps.h"

namespace twocone::foreign {

/// What another program recorded. All times are of one clock.
struct Recording {
  std::filesystem::path robot_file;    ///< of the robot that it is of; its map is of the place
  std::filesystem::path lower, upper;  ///< folders of pictures
  std::filesystem::path lower_times{},
      upper_times{};                   ///< files of their times (list_pictures); empty: the names tell them
  StampUnit unit = StampUnit::kTold;   ///< of the pictures' times
  std::filesystem::path trajectory{};  ///< TUM file of where the robot was (Trajectory); empty: not known
  std::filesystem::path odometry{};    ///< CSV file of its wheels (WheelFile); empty: not known
  std::optional<double> max_skew_s{};  ///< of a pair, > 0, at most a period; none: half of the shorter median period
};

struct Imported {
  std::size_t frames = 0;
  std::vector<std::string> events;  ///< run.yaml's: what was done and what was left out, a sentence each
};

/// A run folder (DESIGN.md, "A run on disk") of what another program recorded, for localise() and all that reads runs.
///
/// Pairs are as pair_pictures() finds them; a frame's time is the lower picture's, less that of the first frame.
/// Frames that a given trajectory or odometry does not cover are left out. Wheel angles are taken at the frame's time;
/// odometry.tum is reckoned from them from the robot file's start. Without them drive.csv and odometry.tum are empty.
/// The trajectory becomes truth.tum. Commands and times of the recording machine are not known: empty fields.
///
/// A picture that cannot be decoded is left out if it is the last of its folder, where a recording may have been cut
/// off. A failure leaves nothing of the run behind.
/// @param out empty or not there yet
/// @throws files::FileError, runs::DiskError
Imported import_run(const Recording& recording, const std::filesystem::path& out,
                    const std::function<void(double done)>& progress);

}  // namespace twocone::foreign

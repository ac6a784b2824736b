// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/calibrate/calibrate.h"
#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"

/// The files that a calibration reads and writes.
namespace twocone::calibrate {

/// Returns the robot whose rig is calibrated: the one in `file`, or, if that is empty, the run's own.
/// @throws config::FileError; also where the run's own cannot be read any more, or has another rig or drive now than
/// when the run was made
config::Robot robot_to_calibrate(const runlog::RunData& run, const std::filesystem::path& file);

/// Sets a prior by the name of its member. @throws std::invalid_argument that lists the names, or for a sigma that is
/// not finite and > 0
void set_prior(const std::string& name, double sigma, vision::CalibrationPriors& priors);

/// The files of a calibrated robot.
struct Files {
  std::filesystem::path robot, numbers;
  std::filesystem::path map;                   ///< written where the map's landmarks were refined
  std::vector<std::filesystem::path> figures;  ///< lower and upper; none: they are not written

  /// Returns all of them.
  [[nodiscard]] std::vector<std::filesystem::path> all() const;
};
/// Returns the files beside the robot file `out`. @param numbers empty: STEM.calibration.json. @param figures folder of
/// STEM.calibration_lower.svg and STEM.calibration_upper.svg; empty: no figures
Files files_of(const std::filesystem::path& out, const std::filesystem::path& numbers,
               const std::filesystem::path& figures);

/// Writes the files. The robot file is the last, so that if it exists, all that belong to it exist too.
/// @param robot as robot_to_calibrate() returned it. @throws runlog::DiskError, config::FileError
void write_files(const Report& report, const config::Robot& robot, const Files& files);

}  // namespace twocone::calibrate

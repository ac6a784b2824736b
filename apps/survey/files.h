// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/survey/survey.h"

/// The files that a survey writes.
namespace twocone::survey {

struct Files {
  std::filesystem::path map, numbers, figure;
  std::filesystem::path robot, calibration;  ///< of a survey that calibrates; else empty

  /// Returns those that are written.
  [[nodiscard]] std::vector<std::filesystem::path> all() const;
};
/// Returns the files beside the map `out`: STEM.survey.json and STEM.survey.svg.
/// @param robot the robot file of a survey that calibrates; else empty
Files files_of(const std::filesystem::path& out, const std::filesystem::path& robot);

/// Writes the files. @param robot, map with which the survey was made. @throws runlog::DiskError, config::FileError
void write_files(const Report& report, const config::Robot& robot, const config::Map& map, const Files& files);

}  // namespace twocone::survey

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "apps/runlog/run_data.h"

namespace twocone::runlog {

/// Writes run.yaml of `folder` with the robot file and the map as they are on disk, with absolute paths. `estimator:`
/// is that of `robot`, because the command line may change it.
/// @throws DiskError, config::FileError
void write_run_yaml(const std::filesystem::path& folder, const RunInfo& info, const config::Robot& robot,
                    const std::filesystem::path& map_file);

/// Writes run.yaml of `to` as that of `from`, with the robot of `robot_file` and an event that reports the change.
/// @throws DiskError, config::FileError
void write_run_yaml_for_robot(const std::filesystem::path& from, const std::filesystem::path& robot_file,
                              const std::filesystem::path& to);

/// Writes run.yaml of `to` as that of `from`, with the map of `map_file` and the event `event`.
/// @throws DiskError, config::FileError
void write_run_yaml_for_map(const std::filesystem::path& from, const std::filesystem::path& map_file,
                            const std::string& event, const std::filesystem::path& to);

/// The content of run.yaml: info, robot and map.
struct RunYaml {
  RunInfo info;
  config::Robot robot;
  config::Map map;
};
RunYaml read_run_yaml(const std::filesystem::path& folder);

/// Returns the first difference between the robot file and map in run.yaml and the present files, for example
/// "robots/lab_sim.yaml: drive.wheel_radius_m was 0.05, and is 0.06". Empty: no difference. @throws config::FileError
std::string changed_since(const std::filesystem::path& folder);

}  // namespace twocone::runlog

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "apps/runs/run_data.h"

namespace twocone::runs {

/// Writes run.yaml of `folder` anew, with the robot file and the map as they are now on disk, paths made absolute; but
/// `estimator:` is that of `robot`, which was perhaps asked for on the command line.
/// @throws DiskError, files::FileError
void write_run_yaml(const std::filesystem::path& folder, const RunInfo& info, const files::Robot& robot,
                    const std::filesystem::path& map_file);

/// run.yaml of `to`: that of `from`, but for the robot, which is now that of `robot_file`, and an event that says so.
/// @throws DiskError, files::FileError
void write_run_yaml_for_robot(const std::filesystem::path& from, const std::filesystem::path& robot_file,
                              const std::filesystem::path& to);

/// run.yaml of `to`: that of `from`, but for the map, which is now that of `map_file`, and an event that says what was
/// made of it. @throws DiskError, files::FileError
void write_run_yaml_for_map(const std::filesystem::path& from, const std::filesystem::path& map_file,
                            const std::string& event, const std::filesystem::path& to);

/// run.yaml's part of a run: info, robot and map. @throws files::FileError
struct RunYaml {
  RunInfo info;
  files::Robot robot;
  files::Map map;
};
RunYaml read_run_yaml(const std::filesystem::path& folder);

/// The first difference between the robot file and map that run.yaml keeps and those files as they are now:
/// "robots/lab_sim.yaml: drive.wheel_radius_m was 0.05, and is 0.06". Empty: none. @throws files::FileError
std::string changed_since(const std::filesystem::path& folder);

}  // namespace twocone::runs

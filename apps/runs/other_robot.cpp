// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/run.h"

#include <string>
#include <system_error>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/file_error.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/run_yaml.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/runlog/tables/tables.h"
#include "localisation/odometry.h"

namespace twocone::runs {
namespace {

namespace fs = std::filesystem;

void refuse_other_robots(const runlog::RunData& run, const config::Robot& robot) {
  const auto refuse = [&](const std::string& what) {
    throw config::FileError("{}: {} is not that of the robot that made {}", robot.file.string(), what,
                            run.folder.string());
  };
  if (robot.start != run.robot.start) refuse("start");
  for (const auto& [name, now, then] :
       {std::tuple{"lower", &robot.lower, &run.robot.lower}, std::tuple{"upper", &robot.upper, &run.robot.upper}}) {
    if (now->width_px != then->width_px || now->height_px != then->height_px) {
      refuse(fmt::format("cameras.{}: {} x {} px", name, now->width_px, now->height_px));
    }
  }
}

/// What localisation takes from a map is compared, not the files' names: a twin's map differs in its scene alone.
void refuse_other_maps(const runlog::RunData& run, const config::Robot& robot) {
  const config::Map map = config::read_map(robot.map);
  if (map.landmarks == run.map.landmarks && map.bounds == run.map.bounds) return;
  throw config::FileError(
      "{}: map: {} has other {} than {}, the map of {}, as it was when the run was made: name a robot file "
      "with that map",
      robot.file.string(), map.file.string(), map.landmarks == run.map.landmarks ? "bounds" : "landmarks",
      run.map.file.string(), run.folder.string());
}

std::string odometry_text(const runlog::RunData& run, const config::Robot& robot) {
  localisation::Odometry odometry(config::to_wheels(robot), config::to_start_pose(robot));
  std::string text;
  if (!runlog::has_odometry(run)) return text;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const localisation::Pose& pose = odometry.update(run.drive[i].left_rad, run.drive[i].right_rad);
    text += runlog::to_line(runlog::PoseRow{run.frames[i].t_s, pose.x_m, pose.y_m, pose.heading_rad}) + '\n';
  }
  return text;
}

}  // namespace

void copy_run_for_robot(const fs::path& from, const fs::path& robot_file, const fs::path& to, bool replace) {
  const runlog::RunData run = runlog::read_run(from);
  const config::Robot robot = config::read_robot(robot_file);
  refuse_other_robots(run, robot);
  refuse_other_maps(run, robot);
  config::check_landmarks(robot, run.map);
  runlog::check_drive(run);
  std::error_code none_such;
  if (fs::equivalent(from, to, none_such)) {
    throw runlog::DiskError("{} is the run itself: choose another --out", to.string());
  }
  if (replace) runlog::remove_run(to);
  runlog::NewFolder folder(to);
  const std::vector<std::string> cameras = config::camera_names(run.robot);
  for (const runlog::FrameRow& row : run.frames) {
    for (const std::string& camera : cameras) {
      // A frame that has lost an image stays so: localise() says what becomes of it.
      const fs::path image = runlog::camera_image_file(from, camera, row.frame);
      if (fs::exists(image)) runlog::link_or_copy(image, runlog::camera_image_file(to, camera, row.frame));
    }
  }
  // Copies: a program may write on at the end of a table.
  for (const char* table : {"frames.csv", "drive.csv"})
    runlog::write_whole(to / table, config::read_text(from / table));
  if (!run.truth.empty()) runlog::write_whole(to / "truth.tum", config::read_text(from / "truth.tum"));
  runlog::write_whole(to / "odometry.tum", odometry_text(run, robot));
  runlog::write_run_yaml_for_robot(from, robot_file, to);  // last: from now on it is a run
  folder.keep();
}

}  // namespace twocone::runs

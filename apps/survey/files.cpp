// SPDX-License-Identifier: Apache-2.0
#include "apps/survey/files.h"

#include <string>

#include <fmt/format.h>

#include "apps/config/calibration_file.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/version.h"

namespace twocone::survey {

namespace fs = std::filesystem;

std::vector<fs::path> Files::all() const {
  std::vector<fs::path> all{map, numbers, figure};
  if (!robot.empty()) all.insert(all.end(), {robot, calibration});
  return all;
}

Files files_of(const fs::path& out, const fs::path& robot) {
  const std::string stem = (out.parent_path() / out.stem()).string();
  Files files{out, stem + ".survey.json", stem + ".survey.svg", robot, {}};
  if (!robot.empty()) files.calibration = config::calibration_file_of(robot);
  return files;
}

void write_files(const Report& report, const config::Robot& robot, const config::Map& map, const Files& files) {
  std::vector<std::string> header{fmt::format("Surveyed by twocone {}, commit {}, with the rig of {}{}.",
                                              runlog::version(), runlog::commit(), report.solution.robot,
                                              report.calibrated ? ", which was calibrated at the same time" : "")};
  for (const std::string& run : report.solution.runs) header.push_back("  run " + run);
  runlog::write_whole(files.numbers, to_json(report));
  runlog::write_whole(files.figure, figure(report));
  config::Map surveyed = map;
  surveyed.scene.reset();  // the one that the file names
  surveyed.survey = files.numbers;
  surveyed.landmarks.clear();
  for (const SurveyedLandmark& l : report.landmarks) surveyed.landmarks.push_back(l.landmark);
  runlog::write_whole(files.map, config::map_text(robot.map, files.map, surveyed, header));
  if (!report.calibrated) return;
  runlog::write_whole(files.calibration, calibrate::to_json(report.solution));
  config::Robot changed = robot;
  changed.rig = report.solution.rig;
  changed.rig.calibration = files.calibration;
  changed.drive.wheel_separation_m = report.solution.drive.wheel_separation_m;
  changed.drive.wheel_radius_m = report.solution.drive.wheel_radius_m;
  changed.drive.sigma = report.solution.drive.sigma;
  changed.map = files.map;
  runlog::write_whole(files.robot, config::robot_text(robot.file, files.robot, changed, header));
}

}  // namespace twocone::survey

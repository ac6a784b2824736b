// SPDX-License-Identifier: Apache-2.0
#include "apps/calibrate/files.h"

#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/config/calibration_file.h"
#include "apps/config/map_file.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/runlog/version.h"
#include "base/errors.h"

namespace twocone::calibrate {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> header_lines(const Report& report) {
  std::vector<std::string> lines{
      fmt::format("Calibrated by twocone {}, commit {}, from {}.", runlog::version(), runlog::commit(), report.robot)};
  for (const std::string& run : report.runs) lines.push_back("  run " + run);
  lines.push_back(fmt::format("Sightings' residuals: lower {:.3f} -> {:.3f} px, upper {:.3f} -> {:.3f} px.",
                              report.result.rms_before_px[0], report.result.rms_after_px[0],
                              report.result.rms_before_px[1], report.result.rms_after_px[1]));
  if (report.exchanged) lines.emplace_back("The cameras were exchanged: lower and upper have changed places here.");
  std::string kept;
  for (const vision::CalibratedParameter& p : report.result.parameters) {
    if (!p.observed && !p.derived) kept += (kept.empty() ? "" : ", ") + p.name;
  }
  if (!kept.empty()) lines.push_back("Not observed, kept as they were: " + kept + ".");
  return lines;
}

/// Returns the lock of the run folder that contains `file`, or nothing if no run folder does.
std::optional<runlog::RunLock> lock_around(const fs::path& file) {
  const auto folder = fs::absolute(file).parent_path();
  if (!fs::exists(folder / "run.yaml")) return {};
  return std::optional<runlog::RunLock>(std::in_place, folder);
}

}  // namespace

config::Robot robot_to_calibrate(const runlog::RunData& run, const fs::path& file) {
  if (!file.empty()) return config::read_robot(file);
  config::Robot now;
  try {
    now = config::read_robot(run.robot.file, run.robot.changes);
  } catch (const config::FileError&) {
    throw config::FileError("{}: its robot file {} cannot be read any more: name one with --robot", run.folder.string(),
                            run.robot.file.string());
  }
  if (!(now.rig == run.robot.rig) || !(now.drive == run.robot.drive)) {
    throw config::FileError("{} has another rig or drive now than when {} was made: name one with --robot",
                            run.robot.file.string(), run.folder.string());
  }
  return now;
}

void set_prior(const std::string& name, double sigma, vision::CalibrationPriors& priors) {
  using Priors = vision::CalibrationPriors;
  static const std::map<std::string, double Priors::*> kKnown{{"length_m", &Priors::length_m},
                                                              {"mirror_separation_m", &Priors::mirror_separation_m},
                                                              {"lens_height_m", &Priors::lens_height_m},
                                                              {"centre_px", &Priors::centre_px},
                                                              {"rim_share", &Priors::rim_share},
                                                              {"azimuth_rad", &Priors::azimuth_rad},
                                                              {"tilt_rad", &Priors::tilt_rad},
                                                              {"axis_offset_m", &Priors::axis_offset_m},
                                                              {"lower_axis_offset_m", &Priors::lower_axis_offset_m},
                                                              {"apex_rad", &Priors::apex_rad},
                                                              {"distortion", &Priors::distortion},
                                                              {"wheel_radius_share", &Priors::wheel_radius_share},
                                                              {"wheel_ratio", &Priors::wheel_ratio},
                                                              {"wheel_separation_m", &Priors::wheel_separation_m},
                                                              {"latency_s", &Priors::latency_s},
                                                              {"skew_s", &Priors::skew_s},
                                                              {"readout_s", &Priors::readout_s}};
  const auto found = kKnown.find(name);
  if (found == kKnown.end()) {
    std::vector<std::string> names;
    names.reserve(kKnown.size());
    for (const auto& [known, prior] : kKnown) names.push_back(known);
    throw base::InvalidArgument("no prior '{}'; there are: {}", name, fmt::join(names, ", "));
  }
  if (!(sigma > 0) || !std::isfinite(sigma)) throw base::InvalidArgument("prior {} is {}, must be > 0", name, sigma);
  priors.*found->second = sigma;
}

std::vector<fs::path> Files::all() const {
  std::vector<fs::path> all{robot, numbers, map};
  all.insert(all.end(), figures.begin(), figures.end());
  return all;
}

Files files_of(const fs::path& out, const fs::path& numbers, const fs::path& figures) {
  // The names contain that of the robot file, because two calibrations may share a folder.
  const std::string stem = out.stem().string();
  Files files{
      out, numbers.empty() ? config::calibration_file_of(out) : numbers, out.parent_path() / (stem + ".map.yaml"), {}};
  if (figures.empty()) return files;
  for (const char* view : {"lower", "upper"}) {
    files.figures.push_back(figures / fmt::format("{}.calibration_{}.svg", stem, view));
  }
  return files;
}

void write_files(const Report& report, const config::Robot& robot, const Files& files) {
  const auto lock = lock_around(files.robot);
  runlog::write_whole(files.numbers, to_json(report));
  if (!files.figures.empty()) {
    runlog::make_folder(files.figures[0].parent_path());
    runlog::write_whole(files.figures[0], residual_figure(report, vision::Side::kLower));
    runlog::write_whole(files.figures[1], residual_figure(report, vision::Side::kUpper));
  }
  config::Robot calibrated = robot;
  calibrated.rig = report.rig;
  if (report.exchanged) {
    for (auto& change : config::exchange_cameras(robot)) calibrated.changes.push_back(std::move(change));
    std::swap(calibrated.lower, calibrated.upper);
  }
  calibrated.drive.wheel_separation_m = report.drive.wheel_separation_m;
  calibrated.drive.wheel_radius_m = report.drive.wheel_radius_m;
  calibrated.drive.sigma = report.drive.sigma;
  const std::vector<Landmark> landmarks = refined_landmarks(report);
  if (!landmarks.empty()) {
    config::Map refined = config::read_map(robot.map);
    refined.landmarks = landmarks;
    refined.scene.reset();  // the one that the file names
    runlog::write_whole(files.map, config::map_text(robot.map, files.map, refined, header_lines(report)));
    calibrated.map = files.map;
  }
  if (report.has_one_map) calibrated.rig.calibration = files.numbers;
  runlog::write_whole(files.robot, config::robot_text(robot.file, files.robot, calibrated, header_lines(report)));
}

}  // namespace twocone::calibrate

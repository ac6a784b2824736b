// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/calibrate/calibrate.h"
#include "apps/config/calibration_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/runlog/version.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"

namespace twocone::cli {
namespace {

struct CalibrateArguments {
  std::vector<std::filesystem::path> runs;
  std::filesystem::path out;
  std::filesystem::path robot;
  std::filesystem::path json;
  std::filesystem::path figures;
  std::vector<std::string> priors;
  bool force = false;
  calibrate::Settings settings;
};

/// Sets the prior of a text such as "tilt_rad=0.01".
void set_prior(const std::string& text, vision::CalibrationPriors& priors) {
  const std::map<std::string, double*> known{{"length_m", &priors.length_m},
                                             {"mirror_separation_m", &priors.mirror_separation_m},
                                             {"lens_height_m", &priors.lens_height_m},
                                             {"centre_px", &priors.centre_px},
                                             {"rim_share", &priors.rim_share},
                                             {"azimuth_rad", &priors.azimuth_rad},
                                             {"tilt_rad", &priors.tilt_rad},
                                             {"axis_offset_m", &priors.axis_offset_m},
                                             {"lower_axis_offset_m", &priors.lower_axis_offset_m},
                                             {"apex_rad", &priors.apex_rad},
                                             {"distortion", &priors.distortion},
                                             {"wheel_radius_share", &priors.wheel_radius_share},
                                             {"wheel_ratio", &priors.wheel_ratio},
                                             {"wheel_separation_m", &priors.wheel_separation_m},
                                             {"latency_s", &priors.latency_s},
                                             {"skew_s", &priors.skew_s},
                                             {"readout_s", &priors.readout_s}};
  const std::size_t equals = text.find('=');
  const auto found = known.find(text.substr(0, equals));
  if (equals == std::string::npos || found == known.end()) {
    std::vector<std::string> names;
    names.reserve(known.size());
    for (const auto& [name, prior] : known) names.push_back(name);
    throw BadUsage("--prior '{}' must be NAME=SIGMA with one of: {}", text, fmt::join(names, ", "));
  }
  const std::string number = text.substr(equals + 1);
  char* end = nullptr;
  const double sigma = std::strtod(number.c_str(), &end);
  if (*end != '\0' || !(sigma > 0) || !std::isfinite(sigma)) {
    throw BadUsage("--prior {} is '{}', must be a number > 0", found->first, number);
  }
  *found->second = sigma;
}

/// Returns the robot whose rig is calibrated: the one of the run, unless another file is named.
config::Robot robot_of(const CalibrateArguments& options, const runlog::RunData& run) {
  if (!options.robot.empty()) return config::read_robot(options.robot);
  config::Robot now;
  try {
    now = config::read_robot(run.robot.file, run.robot.changes);
  } catch (const config::FileError&) {
    throw CommandFailed("{}: its robot file {} cannot be read any more: name one with --robot", run.folder.string(),
                        run.robot.file.string());
  }
  if (!(now.rig == run.robot.rig) || !(now.drive == run.robot.drive)) {
    throw CommandFailed("{} has another rig or drive now than when {} was made: name one with --robot",
                        run.robot.file.string(), run.folder.string());
  }
  return now;
}

std::vector<std::string> header_lines(const calibrate::Report& report) {
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
std::optional<runlog::RunLock> lock_around(const std::filesystem::path& file) {
  const auto folder = std::filesystem::absolute(file).parent_path();
  if (!std::filesystem::exists(folder / "run.yaml")) return {};
  return std::optional<runlog::RunLock>(std::in_place, folder);
}

void calibrate_with(CalibrateArguments options) {
  // Bad usage is refused before any file is read; the priors themselves follow from the robot file.
  vision::CalibrationPriors checked;
  for (const std::string& prior : options.priors) set_prior(prior, checked);
  // The names contain that of the robot file, because two calibrations may share a folder.
  const std::string stem = options.out.stem().string();
  if (options.json.empty()) options.json = config::calibration_file_of(options.out);
  const std::filesystem::path map = options.out.parent_path() / (stem + ".map.yaml");
  std::vector<std::filesystem::path> results{options.out, options.json, map};
  if (!options.figures.empty()) {
    for (const char* view : {"lower", "upper"}) {
      results.push_back(options.figures / fmt::format("{}.calibration_{}.svg", stem, view));
    }
  }
  if (!options.force) refuse_overwriting(results);

  std::vector<runlog::RunData> runs;
  for (const auto& folder : options.runs) runs.push_back(runlog::read_run(folder));
  const config::Robot robot = robot_of(options, runs.front());
  options.settings.priors = calibrate::priors_of(robot);
  for (const std::string& prior : options.priors) set_prior(prior, options.settings.priors);
  ProgressBar bar("calibrate");
  options.settings.progress = [&bar](double done) { bar.show(done); };
  const calibrate::Report report = value_or_fail(calibrate::calibrate(runs, robot, options.settings));
  bar.remove();
  const auto lock = lock_around(options.out);
  runlog::write_whole(options.json, calibrate::to_json(report));
  if (!options.figures.empty()) {
    runlog::make_folder(options.figures);
    runlog::write_whole(results[3], calibrate::residual_figure(report, vision::Side::kLower));
    runlog::write_whole(results[4], calibrate::residual_figure(report, vision::Side::kUpper));
  }
  // The robot file is written last. If it exists, all files that belong to it exist too.
  config::Robot calibrated = robot;
  calibrated.rig = report.rig;
  if (report.exchanged) {
    for (auto& change : config::exchange_cameras(robot)) calibrated.changes.push_back(std::move(change));
    std::swap(calibrated.lower, calibrated.upper);
  }
  calibrated.drive.wheel_separation_m = report.drive.wheel_separation_m;
  calibrated.drive.wheel_radius_m = report.drive.wheel_radius_m;
  calibrated.drive.sigma = report.drive.sigma;
  const std::vector<Landmark> landmarks = calibrate::refined_landmarks(report);
  if (!landmarks.empty()) {
    config::Map refined = config::read_map(robot.map);
    refined.landmarks = landmarks;
    refined.scene.reset();  // the one that the file names
    runlog::write_whole(map, config::map_text(robot.map, map, refined, header_lines(report)));
    calibrated.map = map;
  }
  if (report.has_one_map) calibrated.rig.calibration = options.json;
  runlog::write_whole(options.out, config::robot_text(robot.file, options.out, calibrated, header_lines(report)));
  fmt::print("{}\nrobot file  {}\nnumbers     {}\n", calibrate::table(report), options.out.string(),
             options.json.string());
  if (!options.figures.empty()) fmt::print("figures     {}, {}\n", results[3].string(), results[4].string());
}

}  // namespace

void add_calibrate(CLI::App& program) {
  auto options = std::make_shared<CalibrateArguments>();
  CLI::App* command = program.add_subcommand(
      "calibrate", "Find the rig's own errors from a drive among known landmarks; write a corrected robot file");
  command->add_option("RUN", options->runs, "Run folders, also of runs that were cut off; all of one robot")
      ->required();
  command->add_option("--out", options->out, "Robot file to write")->required();
  command->add_option("--robot", options->robot, "Robot file to start from; default: the run's own");
  command->add_option("--json", options->json, "The numbers for programs; default: STEM.calibration.json beside --out");
  command->add_option("--figures", options->figures,
                      "Folder for STEM.calibration_lower.svg and _upper.svg, STEM as in --out STEM.yaml");
  add_checked(command, "--frames", options->settings.frames, "Number of frames to use, spread over the runs",
              CLI::Range(4, 100'000));
  command->add_option("--prior", options->priors,
                      "NAME=SIGMA: prior standard deviation of a number, as length_m=0.001; can be repeated");
  command->add_flag("--distortion", options->settings.fit_distortion, "Also find k1 and k2 of both lenses");
  command->add_flag("--force", options->force, "Replace files that exist");
  command->callback([options] { calibrate_with(*options); });
}

}  // namespace twocone::cli

// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "apps/calibrate/calibrate.h"
#include "apps/calibrate/files.h"
#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"
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
  const std::size_t equals = text.find('=');
  const std::string number = equals == std::string::npos ? "" : text.substr(equals + 1);
  char* end = nullptr;
  const double sigma = std::strtod(number.c_str(), &end);
  if (number.empty() || *end != '\0') throw BadUsage("--prior '{}' must be NAME=SIGMA", text);
  try {
    calibrate::set_prior(text.substr(0, equals), sigma, priors);
  } catch (const std::invalid_argument& error) {
    throw BadUsage("--prior: {}", error.what());
  }
}

void calibrate_with(CalibrateArguments options) {
  // Bad usage is refused before any file is read; the priors themselves follow from the robot file.
  vision::CalibrationPriors checked;
  for (const std::string& prior : options.priors) set_prior(prior, checked);
  const calibrate::Files files = calibrate::files_of(options.out, options.json, options.figures);
  if (!options.force) refuse_overwriting(files.all());

  std::vector<runlog::RunData> runs;
  for (const auto& folder : options.runs) runs.push_back(runlog::read_run(folder));
  const config::Robot robot = calibrate::robot_to_calibrate(runs.front(), options.robot);
  options.settings.priors = calibrate::priors_of(robot);
  for (const std::string& prior : options.priors) set_prior(prior, options.settings.priors);
  ProgressBar bar("calibrate");
  options.settings.progress = [&bar](double done) { bar.show(done); };
  const calibrate::Report report = value_or_fail(calibrate::calibrate(runs, robot, options.settings));
  bar.remove();
  calibrate::write_files(report, robot, files);
  fmt::print("{}\nrobot file  {}\nnumbers     {}\n", calibrate::table(report), files.robot.string(),
             files.numbers.string());
  if (!files.figures.empty()) fmt::print("figures     {}, {}\n", files.figures[0].string(), files.figures[1].string());
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

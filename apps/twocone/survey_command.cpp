// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/calibrate/calibrate.h"
#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"
#include "apps/survey/files.h"
#include "apps/survey/survey.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"

namespace twocone::cli {
namespace {

struct SurveyArguments {
  std::vector<std::filesystem::path> runs;
  std::filesystem::path out, robot, calibrated;
  std::vector<std::vector<std::string>> distances;
  double distance_sigma_m = 0.002;
  bool refines = false;
  bool force = false;
  survey::Settings settings;
};

/// Reads a distance: two names and metres.
survey::TapeDistance distance_of(const std::vector<std::string>& words, double sigma_m) {
  char* end = nullptr;
  const double distance_m = std::strtod(words[2].c_str(), &end);
  if (*end != '\0' || !(distance_m > 0) || !std::isfinite(distance_m) || words[0] == words[1]) {
    throw BadUsage("--distance {} {} {} must be two different landmarks and their distance in metres, > 0", words[0],
                   words[1], words[2]);
  }
  return {words[0], words[1], distance_m, sigma_m};
}

void survey_with(SurveyArguments options) {
  for (const auto& words : options.distances) {
    options.settings.distances.push_back(distance_of(words, options.distance_sigma_m));
  }
  options.settings.calibrates = !options.calibrated.empty();
  if (!options.settings.calibrates && !options.settings.distances.empty()) {
    throw BadUsage("--distance needs --calibrate FILE: a distance corrects the sizes of the rig, which give the scale");
  }
  const survey::Files files = survey::files_of(options.out, options.calibrated);
  if (!options.force) refuse_overwriting(files.all());

  std::vector<runlog::RunData> runs;
  for (const auto& folder : options.runs) runs.push_back(runlog::read_run(folder));
  const config::Robot robot = options.robot.empty() ? runs.front().robot : config::read_robot(options.robot);
  options.settings.priors = calibrate::priors_of(robot);
  const config::Map map = config::read_map(robot.map);
  if (options.refines) {
    if (map.landmarks.empty())
      throw BadUsage("--refine: {} has no landmarks, so that there is nothing to refine", robot.map.string());
    options.settings.measured = map.landmarks;
  }
  ProgressBar bar("survey");
  options.settings.progress = [&bar](double done) { bar.show(done); };
  const survey::Report report = value_or_fail(survey::survey(runs, robot, options.settings));
  bar.remove();
  survey::write_files(report, robot, map, files);
  fmt::print("{}map         {}\nnumbers     {}\nfigure      {}\n", survey::table(report), files.map.string(),
             files.numbers.string(), files.figure.string());
  if (report.calibrated) fmt::print("robot file  {}\n", files.robot.string());
}

}  // namespace

void add_survey(CLI::App& program) {
  auto options = std::make_shared<SurveyArguments>();
  CLI::App* command = program.add_subcommand(
      "survey", "Find the landmarks of a room from a drive, without a map of them; write their map");
  command->add_option("RUN", options->runs, "Run folders, all of one robot in one room")->required();
  command->add_option("--out", options->out, "Map file to write; STEM.survey.json and STEM.survey.svg beside it")
      ->required();
  command->add_option("--robot", options->robot, "Robot file; default: the run's own");
  command->add_option("--calibrate", options->calibrated,
                      "Also find the rig, and write this robot file; without it the rig is taken as it is believed");
  command
      ->add_option("--distance", options->distances,
                   "FROM TO METRES: distance between the axes of two landmarks by tape; can be repeated")
      ->type_size(3)
      ->type_name("NAME NAME METRES");
  add_checked(command, "--distance-sigma", options->distance_sigma_m, "Standard deviation of these distances, m",
              CLI::PositiveNumber);
  command->add_flag(
      "--refine", options->refines,
      "Refine the robot's map within its sigmas, and name landmarks that were moved since it was measured");
  add_checked(command, "--frames", options->settings.frames, "Number of frames to use, spread over the runs",
              CLI::Range(4, 100'000));
  command->add_flag("--force", options->force, "Replace files that exist");
  command->callback([options] { survey_with(*options); });
}

}  // namespace twocone::cli

// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "apps/import/import_run.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"

namespace twocone::cli {
namespace {

struct ImportArguments {
  importer::Recording recording;
  std::filesystem::path out;
  std::optional<double> max_skew_ms;
};

void import_with(ImportArguments options) {
  if (options.max_skew_ms) options.recording.max_skew_s = *options.max_skew_ms / 1e3;
  ProgressBar bar("import");
  const importer::Imported imported =
      importer::import_run(options.recording, options.out, [&bar](double done) { bar.show(done); });
  bar.remove();
  for (const std::string& event : imported.events) say(event);
  say(fmt::format("{} frames are in {}; next: twocone localise {}", imported.frames, options.out.string(),
                  options.out.string()));
}

}  // namespace

void add_import(CLI::App& program) {
  auto options = std::make_shared<ImportArguments>();
  importer::Recording& recording = options->recording;
  std::map<std::string, importer::StampUnit> units;
  for (const importer::NamedUnit& named : importer::kNamedUnits) units.emplace(named.name, named.unit);
  CLI::App* command = program.add_subcommand("import", "Make a run folder from a recording of another program");
  command->add_option("--robot", recording.robot_file, "Robot file of the recorded robot")->required();
  command->add_option("--lower", recording.lower, "Folder of the lower camera's images, PNG or JPEG")->required();
  command->add_option("--upper", recording.upper, "Folder of the upper camera's images")->required();
  command->add_option("--out", options->out, "Run folder to make")->required();
  command->add_option("--lower-times", recording.lower_times,
                      "Lines TIME NAME or TIME,NAME of the lower images; default: their names are the times");
  command->add_option("--upper-times", recording.upper_times, "The same for the upper images");
  command
      ->add_option_function<std::string>(
          "--times-in", [options, units](const std::string& unit) { options->recording.unit = units.at(unit); },
          "Unit of the images' times: s, ms, us or ns; default: seconds if they have a decimal point, "
          "nanoseconds if they have 19 digits")
      ->check(CLI::IsMember(units));
  command->add_option("--trajectory", recording.trajectory,
                      "TUM file of the robot's true poses from another system, on the images' clock");
  command->add_option("--odometry", recording.odometry,
                      "CSV file of columns t_s,left_rad,right_rad or t_s,x_m,y_m,heading_rad, on the images' clock");
  command->add_option("--max-skew-ms", options->max_skew_ms,
                      "Greatest time between the two images of a pair; default: half of their median period");
  command->callback([options] { import_with(*options); });
}

}  // namespace twocone::cli

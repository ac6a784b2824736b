// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "apps/report/report.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/runs/run.h"
#include "apps/twocone/command_line.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"

namespace twocone::cli {
namespace {

struct LocaliseArguments {
  std::filesystem::path folder;
  std::filesystem::path robot;
  std::filesystem::path out;
  std::string method;  ///< empty: the run's
  bool allow_missing = false;
  bool replace = false;
};

/// Returns the method of --method, or of the other robot's file, or of the run.
estimation::Method method_of(const LocaliseArguments& options) {
  if (!options.method.empty()) return estimation::method_named(options.method);
  if (!options.robot.empty()) {
    const config::Robot robot = config::read_robot(options.robot);
    if (!robot.estimator.method.empty()) return estimation::method_named(robot.estimator.method);
  }
  return estimation::method_named(runlog::read_run_yaml(options.folder).info.method);
}

runlog::RunData localise(const LocaliseArguments& options, estimation::Method method,
                         const std::filesystem::path& folder) {
  const std::atomic<bool>& stop = stop_on_signals();
  ProgressBar bar("localise");
  const runs::LocaliseOptions how{.allow_missing = options.allow_missing, .stop = &stop};
  return value_or_interrupted(
      runs::localise(
          folder, method, [&bar](double done) { bar.show(done); }, how),
      fmt::format("interrupted: {} is as it was; next: the same command again", options.folder.string()));
}

/// Localises the run's images with another robot's file. After a failure no folder is left that would block a retry.
runlog::RunData localise_copy(const LocaliseArguments& options, estimation::Method method) {
  runs::copy_run_for_robot(options.folder, options.robot, options.out, options.replace);
  try {
    return localise(options, method, options.out);
  } catch (...) {
    runlog::remove_run(options.out);
    throw;
  }
}

void localise_with(const LocaliseArguments& options) {
  if (options.replace && options.out.empty()) throw BadUsage("--force needs --out: the run that it replaces");
  const estimation::Method method = method_of(options);
  const runlog::RunData data =
      options.robot.empty() ? localise(options, method, options.folder) : localise_copy(options, method);
  std::vector<std::string> notes;
  fmt::print("{}", report::table_of(data, notes));
  for (const std::string& note : notes) say(fmt::format("note: {}", note));
}

}  // namespace

void add_localise(CLI::App& program) {
  auto options = std::make_shared<LocaliseArguments>();
  CLI::App* command = program.add_subcommand("localise", "Repeat ranges and fixes offline, from a run's stored frames");
  command->add_option("DIR", options->folder, "Run folder")->required();
  command
      ->add_option("--method", options->method, "How to range and localise (default: as the run, or as --robot says)")
      ->check(is_method());
  auto* robot =
      command->add_option("--robot", options->robot,
                          "Robot file whose rig, wheels and estimator to use, such as one from calibrate; needs --out");
  auto* out = command->add_option("--out", options->out, "Run folder to make for the results, with the same images");
  command->add_flag("--allow-missing", options->allow_missing,
                    "Leave frames that have lost an image without an answer (verdict no_image)");
  command->add_flag("--force", options->replace, "Replace the run that is in --out");
  robot->needs(out);
  out->needs(robot);
  command->callback([options] { localise_with(*options); });
}

}  // namespace twocone::cli

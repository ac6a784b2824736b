// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "apps/report/table.h"
#include "apps/runs/other_robot.h"
#include "apps/runs/replace_run.h"
#include "apps/runs/run.h"
#include "apps/runs/run_yaml.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/progress_bar.h"
#include "apps/twocone/standard_streams.h"

namespace twocone::cli {
namespace {

struct Options {
  std::filesystem::path folder;
  std::filesystem::path robot;
  std::filesystem::path out;
  std::string method;  ///< empty: the run's
  bool allow_missing = false;
  bool replace = false;
};

/// As the run was made, unless another robot's file says otherwise.
runs::Method method_of(const Options& options) {
  if (!options.method.empty()) return runs::method_named(options.method);
  if (!options.robot.empty()) {
    const files::Robot robot = files::read_robot(options.robot);
    if (!robot.estimator.method.empty()) return runs::method_named(robot.estimator.method);
  }
  return runs::method_named(runs::read_run_yaml(options.folder).info.method);
}

runs::RunData localise(const Options& options, runs::Method method, const std::filesystem::path& folder) {
  const std::atomic<bool>& stop = stop_on_signals();
  ProgressBar bar("localise");
  runs::LocaliseOptions how;
  if (options.allow_missing) how.missing = runs::Missing::kAllowed;
  how.stop = &stop;
  return value_or_interrupted(
      runs::localise(
          folder, method, [&bar](double done) { bar.show(done); }, how),
      fmt::format("interrupted: {} is as it was; next: the same command again", options.folder.string()));
}

/// The run's images under another robot's file. What fails leaves no folder that would bar the next try.
runs::RunData localise_copy(const Options& options, runs::Method method) {
  runs::copy_run_for_robot(options.folder, options.robot, options.out, options.replace);
  try {
    return localise(options, method, options.out);
  } catch (...) {
    runs::remove_run(options.out);
    throw;
  }
}

void execute(const Options& options) {
  if (options.replace && options.out.empty()) throw BadUsage("--force needs --out: the run that it replaces");
  const runs::Method method = method_of(options);
  const runs::RunData data =
      options.robot.empty() ? localise(options, method, options.folder) : localise_copy(options, method);
  std::vector<std::string> notes;
  fmt::print("{}", report::table_of(data, notes));
  for (const std::string& note : notes) say(fmt::format("note: {}", note));
}

}  // namespace

void add_localise(CLI::App& program) {
  auto options = std::make_shared<Options>();
  CLI::App* command = program.add_subcommand("localise", "Ranges and fixes again, offline, from a run's stored frames");
  command->add_option("DIR", options->folder, "Run folder")->required();
  command
      ->add_option("--method", options->method, "How to range and localise (default: as the run, or as --robot says)")
      ->check(CLI::IsMember(runs::method_names()));
  auto* robot =
      command->add_option("--robot", options->robot,
                          "Robot file whose rig, wheels and estimator to take, as calibrate writes one; needs --out");
  auto* out = command->add_option("--out", options->out, "Run folder to make for them, of the same pictures");
  command->add_flag("--allow-missing", options->allow_missing,
                    "Leave frames that have lost an image without an answer (verdict no_image)");
  command->add_flag("--force", options->replace, "Replace the run that is in --out");
  robot->needs(out);
  out->needs(robot);
  command->callback([options] { execute(*options); });
}

}  // namespace twocone::cli

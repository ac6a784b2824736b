// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "apps/report/report.h"
#include "apps/runlog/run_data.h"
#include "apps/runs/run.h"
#include "apps/twocone/command_line.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"

namespace twocone::cli {
namespace {

struct RunArguments {
  std::filesystem::path robot;
  std::filesystem::path resume;  ///< run folder; empty: a new run
  std::string method;            ///< empty: the robot file's
  std::optional<double> budget_ms;
  runs::RunOptions run;
  double patience_s = std::chrono::duration<double>(run.patience).count();
};

/// Returns runs/NAME-BEHAVIOUR-seedN, with -2, -3 ... appended if that exists.
std::filesystem::path free_folder(const std::string& robot, const runs::RunOptions& run) {
  const std::string name = fmt::format("runs/{}-{}-seed{}", robot, run.behaviour, run.seed);
  std::filesystem::path folder = name;
  for (int i = 2; std::filesystem::exists(folder); ++i) folder = fmt::format("{}-{}", name, i);
  return folder;
}

config::Robot with_budget(config::Robot robot, const RunArguments& options) {
  try {
    return estimation::with_budget(std::move(robot), options.run.method, *options.budget_ms / 1000);
  } catch (const std::invalid_argument& error) {
    throw BadUsage("--budget-ms: {}", error.what());
  }
}

/// Returns what an interrupted run has stored, and the command that continues it.
std::string next_step(const runs::RunOptions& run) {
  if (!std::filesystem::exists(run.out / "run.yaml")) {
    return "interrupted before its first frame: no run folder is left; next: the same command again";
  }
  const std::string folder = run.out.string();
  const runlog::RunData data = runlog::read_run(run.out, "", runlog::Tables::kFrames);
  return fmt::format("interrupted: {} of {} frames are in {}; next: twocone {} {}", data.frames.size(),
                     data.info.frames_wanted, folder,
                     runs::why_not_resumed(run.out).empty() ? "run --resume" : "report", folder);
}

void run_with(RunArguments options) {
  config::Robot robot;
  if (options.resume.empty()) {
    robot = config::read_robot(options.robot);
    options.run.method =
        options.method.empty() ? estimation::method_of(robot) : estimation::method_named(options.method);
    if (options.budget_ms) robot = with_budget(std::move(robot), options);
    if (options.run.out.empty()) options.run.out = free_folder(robot.name, options.run);
  } else {
    const runlog::RunYaml before = runlog::read_run_yaml(options.resume);
    robot = before.robot;
    options.run.frames = before.info.frames_wanted;
    options.run.out = options.resume;
  }

  // After a signal, the present frame is completed and the wheels stop.
  const std::atomic<bool>& stop = stop_on_signals();

  {
    ProgressBar bar(fmt::format("{} frames", options.run.frames));
    options.run.notify = [&bar](const std::string& event) { bar.say(event); };
    options.run.patience = std::chrono::milliseconds(std::llround(1000 * options.patience_s));
    const auto progress = [&bar](double done) { bar.show(done); };
    const auto driven = options.resume.empty()
                            ? runs::run(robot, config::read_map(robot.map), options.run, progress, stop)
                            : runs::resume(options.run.out, options.run, progress, stop);
    if (!driven && stop) throw Interrupted(next_step(options.run));
    value_or_fail(driven);
  }
  const runlog::RunData data = runlog::read_run(options.run.out);
  std::vector<std::string> notes;
  fmt::print("{}", report::table_of(data, notes));
  for (const std::string& note : notes) say(fmt::format("note: {}", note));
  fmt::print("\nrun folder  {}\n", options.run.out.string());
}

}  // namespace

void add_run(CLI::App& program) {
  auto options = std::make_shared<RunArguments>();
  CLI::App* command =
      program.add_subcommand("run", "Drive a robot, range its landmarks, find its position; write a run folder");
  auto* robot = command->add_option("--robot", options->robot, "Robot file (robots/lab_sim.yaml)");
  auto* resume = command->add_option("--resume", options->resume,
                                     "Run folder of a simulated run that was interrupted or killed: continue it with\n"
                                     "the same settings; takes no other option but --log-level");
  add_checked(command, "--frames", options->run.frames, "Stereo frames to take", CLI::Range(1, 100'000'000));
  add_checked(command, "--behaviour", options->run.behaviour, "How to drive: wander, waypoints or still",
              CLI::IsMember({"wander", "waypoints", "still"}));
  command
      ->add_option("--method", options->method,
                   fmt::format("How to range and localise (default: from the robot file, else {})",
                               estimation::to_string(estimation::kDefaultMethod)))
      ->check(is_method());
  command->add_option(
      "--budget-ms", options->budget_ms,
      "Milliseconds for vision and localisation of each frame: method outline refines no longer than that");
  add_checked(command, "--seed", options->run.seed, "Seed of all random numbers of the run", whole_number());
  command->add_option("--out", options->run.out, "Run folder to make (default: runs/ROBOT-BEHAVIOUR-seedN)");
  add_checked(command, "--patience", options->patience_s,
              "Seconds to wait for a device that fails, with the wheels stopped (real robots)",
              number_within(0, 86'400));
  command->add_flag("--truth", options->run.truth,
                    "Also write the true content of each mirror pixel (simulation; 6 renderings per frame)");
  command->add_flag("--force", options->run.replace, "Replace the run that is in --out");
  for (CLI::Option* const other : command->get_options()) {
    if (other != resume && other->get_name() != "--help") resume->excludes(other);
  }
  command->callback([options, robot, resume] {
    if (robot->count() + resume->count() == 0) throw BadUsage("run: --robot is required, or --resume");
    run_with(*options);
  });
}

}  // namespace twocone::cli

// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/config/robot_file.h"
#include "apps/runlog/storage/disk.h"
#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/output.h"
#include "apps/tradeoff/plan.h"
#include "apps/tradeoff/run_shards.h"
#include "apps/tradeoff/shard.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"

namespace twocone::cli {
namespace {

struct TradeoffArguments {
  RobotArgument robot;
  std::filesystem::path out;
  tradeoff::PlanOptions plan;
  std::optional<sim_povray::RendererKind> renderer;
  std::optional<int> shard;
  bool shards = false, merge = false;
  std::optional<double> target_mm, budget_ms;
  std::filesystem::path write_robot;
  int validation_episodes = 40;

  [[nodiscard]] std::optional<tradeoff::Requirement> requirement() const {
    if (target_mm) return tradeoff::Requirement{tradeoff::Goal::kTarget, *target_mm / 1e3};
    if (budget_ms) return tradeoff::Requirement{tradeoff::Goal::kBudget, *budget_ms / 1e3};
    return std::nullopt;
  }
};

/// Makes the checks of the options that CLI11 does not make.
void check(const TradeoffArguments& options) {
  const auto positive = [](const char* name, const std::optional<double>& value) {
    if (value && !(std::isfinite(*value) && *value > 0)) throw BadUsage("{} is {}, must be a number > 0", name, *value);
  };
  positive("--target-mm", options.target_mm);
  positive("--budget-ms", options.budget_ms);
  if (!options.write_robot.empty() && !options.requirement()) {
    throw BadUsage("--write-robot needs --target-mm or --budget-ms: the requirement for the choice");
  }
  // A fault of --write-robot is reported before the sweep, not after it.
  const auto folder = options.write_robot.parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder)) {
    throw CommandFailed("--write-robot: {} is no folder", folder.string());
  }
  std::error_code none_such;
  if (std::filesystem::equivalent(options.write_robot, options.robot.file, none_such)) {
    throw CommandFailed("--write-robot: {} is the robot that is swept, choose another name",
                        options.write_robot.string());
  }
}

tradeoff::Watch shown_by(ProgressBar& bar) {
  return {[&bar](double done) { bar.show(done); }, [&bar](const std::string& line) { bar.say(line); }};
}

void run_missing(const tradeoff::Subject& subject, const tradeoff::SweepFolder& folder,
                 const std::vector<std::size_t>& missing, const std::atomic<bool>& stop) {
  if (missing.empty()) return;
  ProgressBar bar(fmt::format("{} settings, {} shards", subject.plan.settings.size(), missing.size()));
  const std::size_t done = value_or_fail(tradeoff::run_shards(subject, folder, missing, shown_by(bar), stop));
  if (done < missing.size()) {
    const std::size_t all = subject.plan.shards.size();
    throw Interrupted("interrupted: {} of {} shards are in {}; next: the same command continues there",
                      all - missing.size() + done, all, folder.path().string());
  }
}

/// Makes the choice and writes its robot file and choice.json.
tradeoff::Choice choose(const TradeoffArguments& options, const tradeoff::Requirement& requirement,
                        const tradeoff::Subject& subject, const tradeoff::Sweep& sweep,
                        const tradeoff::SweepFolder& folder, const std::atomic<bool>& stop) {
  fmt::print("\ngoal    {}; settings that may meet it: {} of {}; each is tested on {} new episodes\n",
             tradeoff::describe(requirement), tradeoff::candidates(sweep, requirement).size(), sweep.settings.size(),
             options.validation_episodes);
  std::fflush(stdout);
  int tried = 0;
  tradeoff::Choice choice = value_or_interrupted(
      tradeoff::choose(sweep, requirement,
                       [&](const tradeoff::Setting& setting) -> Result<tradeoff::Check> {
                         ProgressBar bar(fmt::format("validation {}", ++tried));
                         return tradeoff::run_check(subject, folder, setting, options.validation_episodes,
                                                    shown_by(bar), stop);
                       }),
      fmt::format("interrupted: the sweep is in {}; next: the same command continues there", folder.path().string()));
  for (const tradeoff::Validation& validation : choice.validations)
    fmt::print("tested  {}\n", tradeoff::describe(sweep, validation));
  fmt::print("choice  {}\n", choice.why);
  runlog::write_whole(folder.path() / "choice.json", tradeoff::choice_json(sweep, requirement, choice));
  const std::filesystem::path file = options.write_robot.empty() ? folder.path() / "chosen.yaml" : options.write_robot;
  if (choice.setting) {
    const config::Robot changed =
        tradeoff::robot_of(subject.plan.settings.at(*choice.setting), subject.robot, subject.plan.landmarks);
    runlog::write_whole(file, config::robot_text(subject.robot.file, file, changed,
                                                 tradeoff::choice_header(sweep, requirement, choice)));
    fmt::print("robot   {}\n", file.string());
  } else if (options.write_robot.empty()) {
    // A file from an earlier requirement does not belong to this one.
    std::error_code none_there;
    std::filesystem::remove(file, none_there);
  }
  return choice;
}

void sweep_and_choose(const TradeoffArguments& options, const tradeoff::Subject& subject,
                      const tradeoff::SweepFolder& folder, const std::atomic<bool>& stop) {
  const tradeoff::Sweep sweep = tradeoff::finish_sweep(subject, folder);
  fmt::print("{}", tradeoff::table(sweep));
  std::fflush(stdout);
  std::optional<tradeoff::Choice> choice;
  if (const auto requirement = options.requirement()) {
    choice = choose(options, *requirement, subject, sweep, folder, stop);
  }
  runlog::write_whole(folder.path() / "index.html", tradeoff::page(sweep, choice ? &*choice : nullptr));
  fmt::print("\npage    {}\n", (folder.path() / "index.html").string());
  std::fflush(stdout);
  if (choice && !choice->setting) throw CommandFailed(choice->why);
}

void tradeoff_with(TradeoffArguments options) {
  check(options);
  const config::Robot robot = options.robot.read();
  config::Map map = config::read_map(robot.map);
  if (options.renderer) map.renderer = *options.renderer;
  const tradeoff::Plan plan = tradeoff::make_plan(robot, map, options.plan);
  const std::size_t all = plan.shards.size();
  if (options.shards) {
    fmt::print("{}\n", all);
    return;
  }
  if (options.shard && std::size_t(*options.shard) >= all) {
    throw BadUsage("--shard is {}, this sweep's are 0 to {}", *options.shard, all - 1);
  }
  if (options.out.empty()) options.out = fmt::format("runs/{}-tradeoff-seed{}", robot.name, options.plan.seed);
  if (options.merge && !std::filesystem::exists(options.out)) {
    throw CommandFailed("{}: no such folder, so there is nothing to merge", options.out.string());
  }
  const tradeoff::Subject subject{robot, map, plan};
  const tradeoff::SweepFolder folder(options.out, robot, map, plan);

  // After a signal the present shard is abandoned, and finished ones are kept.
  const std::atomic<bool>& stop = stop_on_signals();
  if (options.shard) return run_missing(subject, folder, {std::size_t(*options.shard)}, stop);
  if (!options.merge) {
    const std::vector<std::size_t> missing = folder.missing();
    if (!missing.empty() && missing.size() < all) {
      say(fmt::format("{} of {} shards are there already", all - missing.size(), all));
    }
    run_missing(subject, folder, missing, stop);
  }
  sweep_and_choose(options, subject, folder, stop);
}

}  // namespace

void add_tradeoff(CLI::App& program) {
  auto options = std::make_shared<TradeoffArguments>();
  CLI::App* command = program.add_subcommand(
      "tradeoff", "Measure what accuracy costs in time: image size, smoothing, estimator, landmarks, rate; choose");
  add_robot(command, options->robot, "Robot file of a simulated robot (robots/lab_sim.yaml)")->required();
  command->add_option("--out", options->out,
                      "Folder of the sweep; a sweep that it holds in part is continued\n"
                      "(default: runs/ROBOT-tradeoff-seedN)");
  add_renderer(command, options->renderer);
  add_checked(command, "--seed", options->plan.seed, "Seed of all random numbers of the sweep", whole_number());
  add_checked(command, "--episodes", options->plan.episodes, "Episodes (short drives) for the cheapest images",
              CLI::Range(3, 100'000));
  command->add_flag("--fine", options->plan.fine, "More sizes, more anti-aliasing, four times the episodes");
  command
      ->add_option_function<std::string>(
          "--jobs",
          [](const std::string& /*jobs*/) {
            throw BadUsage(
                "unknown option '--jobs': start a process with --shard K for each shard, then use --merge "
                "(see twocone tradeoff --help)");
          })
      ->group("");  // it is not in --help
  auto* shard = command->add_option("--shard", options->shard, "Do this shard (from 0) and nothing else: for clusters")
                    ->check(CLI::Range(0, 1'000'000'000));
  auto* shards = command->add_flag("--shards", options->shards, "Print the number of shards, and do nothing else");
  auto* merge = command->add_flag("--merge", options->merge, "Run no shard; fail if one is missing");
  auto* target = command->add_option("--target-mm", options->target_mm,
                                     "Choose the cheapest setting whose mean position error is below this");
  auto* budget =
      command->add_option("--budget-ms", options->budget_ms,
                          "Choose the most accurate setting whose vision and localisation take less time per frame");
  auto* write = command->add_option("--write-robot", options->write_robot,
                                    "Robot file to write for the choice (default: DIR/chosen.yaml)");
  auto* episodes = add_checked(command, "--validation-episodes", options->validation_episodes,
                               "New episodes that test a choice", CLI::Range(3, 100'000));
  shard->excludes(shards, merge, target, budget, write, episodes);
  shards->excludes(merge, target, budget, write, episodes);
  target->excludes(budget);
  command->callback([options] { tradeoff_with(*options); });
}

}  // namespace twocone::cli

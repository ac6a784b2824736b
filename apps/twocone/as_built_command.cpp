// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/as_built/as_built.h"
#include "apps/config/to_layers.h"
#include "apps/twocone/commands.h"

namespace twocone::cli {
namespace {

struct AsBuiltArguments {
  RobotArgument robot;
  std::filesystem::path folder;
  std::uint64_t seed = 1;
  int count = 1;
  std::string unmodelled = "none";
  bool force = false;

  [[nodiscard]] bool is_unmodelled(std::uint64_t of_seed) const {
    return unmodelled == "all" || (unmodelled == "half" && of_seed % 2 == 1);
  }
};

void build_with(const AsBuiltArguments& options) {
  const config::Robot plan = options.robot.read();
  if (!config::is_simulated(plan)) {
    throw CommandFailed("{}: no part has driver sim_povray, must be a simulated robot", plan.file.string());
  }
  const config::Map map = config::read_map(plan.map);
  for (int i = 0; i < options.count; ++i) {
    const std::uint64_t seed = options.seed + std::uint64_t(i);
    const auto folder = options.count == 1 ? options.folder : options.folder / fmt::format("{:04}", seed);
    const as_built::Files files = as_built::files_in(folder);
    if (!options.force) {
      refuse_overwriting({files.scene, files.built_map, files.built, files.believed_map, files.believed});
    }
    const bool unmodelled = options.is_unmodelled(seed);
    as_built::write(
        as_built::draw(plan, map, seed, {}, unmodelled ? std::optional(as_built::Unmodelled{}) : std::nullopt), folder);
    fmt::print("seed {}{}: {}, {}\n", seed, unmodelled ? ", with what no model has" : "", files.built.string(),
               files.believed.string());
  }
}

}  // namespace

void add_as_built(CLI::App& program) {
  auto options = std::make_shared<AsBuiltArguments>();
  CLI::App* command = program.add_subcommand(
      "as-built", "Draw robots and rooms as they are built, within tolerances: scene, the truth, and what is believed");
  add_robot(command, options->robot, "The plan: robot file of a simulated robot (robots/lab_sim.yaml)")->required();
  command->add_option("--out", options->folder, "Folder for the files; with --count, for a folder of each seed")
      ->required()
      ->type_name("DIR");
  add_checked(command, "--seed", options->seed, "Seed of the draws", whole_number());
  add_checked(command, "--count", options->count, "Robots to draw, of this seed and the following",
              CLI::Range(1, 9999));
  add_checked(command, "--unmodelled", options->unmodelled,
              "Robots that also have what no model has: none, all, or half (those with odd seeds)",
              CLI::IsMember({"none", "half", "all"}));
  command->add_flag("--force", options->force, "Replace files that exist");
  command->callback([options] { build_with(*options); });
}

}  // namespace twocone::cli

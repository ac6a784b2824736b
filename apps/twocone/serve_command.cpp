// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

#include "apps/config/map_file.h"
#include "apps/config/to_layers.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"
#include "drivers/sim_povray/simulation_host.h"

namespace twocone::cli {
namespace {

struct ServeArguments {
  std::filesystem::path map;
  std::string name;
};

/// Returns lab for scenes/lab.map.yaml.
std::string map_name(const std::filesystem::path& map) {
  const std::string file = map.filename().string();
  return file.substr(0, file.find('.'));
}

void serve_with(const ServeArguments& options) {
  const sim_povray::PlaceSettings place = config::to_place(config::read_map(options.map));

  // After a signal every robot's wheels stop and the name becomes free.
  const std::atomic<bool>& stop = stop_on_signals();

  const Status served = sim_povray::serve_world(
      place, options.name.empty() ? map_name(options.map) : options.name, [](const std::string& line) { say(line); },
      stop);
  if (!served) throw CommandFailed(served.error().message);
}

}  // namespace

void add_serve(CLI::App& program) {
  auto options = std::make_shared<ServeArguments>();
  CLI::App* command =
      program.add_subcommand("serve", "Run a simulated world for several robots or programs, until it is interrupted");
  command->add_option("--scene", options->map, "Map file of the place (scenes/lab.map.yaml)")->required();
  command->add_option("--name", options->name, "Name for `attach:` of robot files (default: the map file's name)");
  command->callback([options] { serve_with(*options); });
}

}  // namespace twocone::cli

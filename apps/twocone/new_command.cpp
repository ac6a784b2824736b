// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/new_scene/new_scene.h"
#include "apps/twocone/commands.h"

namespace twocone::cli {
namespace {

struct NewArguments {
  new_scene::RoomSettings room;
  std::filesystem::path folder;
  bool force = false;
};

void print_list(const char* title, const std::vector<std::string>& lines) {
  constexpr std::size_t kMost = 12;
  if (lines.empty()) return;
  fmt::print("\n{}\n", title);
  for (std::size_t i = 0; i < std::min(kMost, lines.size()); ++i) fmt::print("  {}\n", lines[i]);
  if (lines.size() > kMost) fmt::print("  and {} more\n", lines.size() - kMost);
}

void print_room(const new_scene::Room& room) {
  fmt::print("unit       1 POV-Ray unit = {:.4g} m ({})\n", room.floor.unit_m, room.floor.why_unit);
  fmt::print("floor      y = {:.6g} units ({})\n", room.floor.units, room.floor.place);
  fmt::print("open area  {:.2f} m2, for the robot's axis\n", room.open_m2);
  fmt::print("obstacles  {}\n", room.obstacles.size());
  fmt::print("start      ({:.2f}, {:.2f}) m\n", room.start.x_m, room.start.y_m);
  fmt::print("landmarks  {:<10} {:>8} {:>8} {:>8} {:>8}  from\n", "", "x_m", "y_m", "radius_m", "top_m");
  for (const auto& [landmark, place, object] : room.landmarks) {
    fmt::print("           {:<10} {:8.4f} {:8.4f} {:8.4f} {:8.4f}  {}\n", landmark.name, landmark.x_m, landmark.y_m,
               landmark.radius_m, landmark.top_m, place.empty() ? "added, in the wrapper" : place);
  }
  print_list("These shapes were taken as a simple shape around them:", room.leniency.bounded);
  print_list("These statements were not understood and left out; what they draw is no obstacle in the map:",
             room.leniency.left_out);
  print_list("Warnings:", room.warnings);
}

void new_with(const NewArguments& options) {
  const new_scene::NewFiles files = new_scene::files_for(options.room.scene, options.folder);
  std::error_code none_there;
  if (std::filesystem::equivalent(options.room.scene, files.wrapper, none_there)) {
    throw CommandFailed("--out {}: the wrapper would replace the scene {}; choose another folder",
                        options.folder.string(), options.room.scene.string());
  }
  if (!options.force) refuse_overwriting({files.wrapper, files.map, files.robot});
  const new_scene::Room room = new_scene::find_room(options.room);
  new_scene::write_files(room, options.room, files);
  print_room(room);
  fmt::print("\nwritten: {}, {}, {}\nnext:    twocone run --robot {} --frames 4\n", files.wrapper.string(),
             files.map.string(), files.robot.string(), files.robot.string());
}

}  // namespace

void add_new(CLI::App& program) {
  auto options = std::make_shared<NewArguments>();
  CLI::App* command = program.add_subcommand(
      "new",
      "Put a robot into a POV-Ray scene: find floor, obstacles and landmarks, and write wrapper, map and robot file");
  command->add_option("SCENE", options->room.scene, "POV-Ray scene (scenes/lab.pov)")->required();
  command->add_option("--out", options->folder, "Folder for NAME.pov, NAME.map.yaml and NAME.yaml")
      ->required()
      ->type_name("DIR");
  command->add_option("--unit-m", options->room.unit_m, "Length of one POV-Ray unit in metres (default: estimated)")
      ->check(number_within(1e-6, 1e6));
  command
      ->add_option("--scene-path", options->room.scene_paths,
                   "Folder that the scene may read, besides its own and POV-Ray's libraries; may be repeated")
      ->type_name("DIR");
  command->add_flag("--force", options->force, "Replace files that exist");
  command->callback([options] { new_with(*options); });
}

}  // namespace twocone::cli

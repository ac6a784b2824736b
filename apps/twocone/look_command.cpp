// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "apps/look/look.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"

namespace twocone::cli {
namespace {

struct LookArguments {
  RobotArgument robot;
  bool force = false;
  look::LookOptions look;
};

/// Returns runs/NAME-look, with -2, -3 ... appended if that exists.
std::filesystem::path free_look_folder(const std::string& robot) {
  const std::string name = fmt::format("runs/{}-look", robot);
  std::filesystem::path folder = name;
  for (int i = 2; std::filesystem::exists(folder); ++i) folder = fmt::format("{}-{}", name, i);
  return folder;
}

void look_with(LookArguments options) {
  const config::Robot robot = options.robot.read();
  const config::Map map = config::read_map(robot.map);
  if (options.look.out.empty()) {
    options.look.out = free_look_folder(robot.name);
  } else if (!options.force) {
    refuse_overwriting(look::files_of(robot, options.look.out));
  }
  const look::Look seen = value_or_fail(look::look(robot, map, options.look));
  for (const std::string& checked : seen.checked) fmt::print("checked  {}\n", checked);
  for (const std::string& note : seen.notes) say(note);
  for (std::size_t i = 0; i < seen.findings.size(); ++i) fmt::print("{:>7}  {}\n", i + 1, seen.findings[i].text);
  for (const std::filesystem::path& file : seen.files) fmt::print("wrote    {}\n", file.string());
  std::fflush(stdout);
  if (seen.findings.empty()) return;
  throw CommandFailed(
      "{}: {} between robot file, map and scene, with their numbers in {}", robot.file.string(),
      seen.findings.size() == 1 ? "1 disagreement" : fmt::format("{} disagreements", seen.findings.size()),
      seen.files.back().string());
}

}  // namespace

void add_look(CLI::App& program) {
  auto options = std::make_shared<LookArguments>();
  CLI::App* command = program.add_subcommand(
      "look",
      "Show a simulated robot's first images and its room from above; list where robot file, map and scene\n"
      "disagree");
  add_robot(command, options->robot, "Robot file (robots/lab_sim.yaml)")->required();
  command
      ->add_option("--out", options->look.out,
                   "Folder for the images: one for each camera, and above.svg (default: a new one, runs/ROBOT-look)")
      ->type_name("DIR");
  command->add_flag("--force", options->force, "Replace these images if they exist in DIR");
  add_renderer(command, options->look.renderer);
  command->footer("Exit status: 0 nothing disagrees, 1 something does, or the command failed, 2 bad usage.");
  command->callback([options] { look_with(*options); });
}

}  // namespace twocone::cli

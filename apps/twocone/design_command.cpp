// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/design/design.h"
#include "apps/design/output.h"
#include "apps/runlog/storage/disk.h"
#include "apps/twocone/commands.h"

namespace twocone::cli {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

struct DesignArguments {
  design::Requirements requirements;
  double camera_deg = requirements.camera_angle_rad / kDegree;
  double lowest_deg = requirements.lowest_rad / kDegree;
  double highest_deg = requirements.highest_rad / kDegree;
  RobotArgument robot;
  std::filesystem::path map;
  std::filesystem::path folder;
  std::string name = "design";
  double edge_noise_px = 0.1;
  bool force = false;
};

void design_with(const DesignArguments& options) {
  const std::filesystem::path& folder = options.folder;
  const bool is_given = !options.robot.file.empty();
  const design::Files files = design::files_in(folder, options.name);
  if (!options.force) {
    refuse_overwriting({files.page, files.data});
    if (!is_given) refuse_overwriting({files.robot, files.map, files.scene, files.profile});
  }
  std::optional<config::Map> map;
  if (!options.map.empty()) map = config::read_map(options.map);
  design::Result result;
  if (is_given) {
    result.robot = options.robot.read();
    if (!map) map = config::read_map(result.robot.map);
  } else {
    design::Requirements requirements = options.requirements;
    requirements.camera_angle_rad = options.camera_deg * kDegree;
    requirements.lowest_rad = options.lowest_deg * kDegree;
    requirements.highest_rad = options.highest_deg * kDegree;
    const design::Design made = [&] {
      try {
        return design::design(requirements);
      } catch (const std::invalid_argument& error) {
        throw BadUsage(std::string(error.what()));
      }
    }();
    design::write_robot(made, map, files);
    result.robot = config::read_robot(files.robot);
    map = config::read_map(files.map);
  }
  result.map = map;
  result.settings = {.sigma_px = options.requirements.sigma_px,
                     .edge_noise_px = options.edge_noise_px,
                     .at_m = options.requirements.at_m};
  result.analysis = design::analyse(result.robot, result.map, result.settings);
  runlog::make_folder(folder);
  runlog::write_whole(files.data, design::design_json(result).dump(1) + '\n');
  runlog::write_whole(files.page, design::page(result));
  fmt::print("{}", design::table(result));
  if (!is_given) {
    fmt::print("\nwritten    {}, {}, {}; for the lathe {}\n", files.robot.string(), files.map.string(),
               files.scene.string(), files.profile.string());
  }
  fmt::print("\npage       {}\n", files.page.string());
  if (!is_given) fmt::print("next       twocone run --robot {} --frames 30\n", files.robot.string());
}

}  // namespace

void add_design(CLI::App& program) {
  auto options = std::make_shared<DesignArguments>();
  design::Requirements& requirements = options->requirements;
  CLI::App* command = program.add_subcommand("design",
                                             "Design a pair of mirrors from requirements, with its simulated twin, or "
                                             "show what a robot's pair can do: what both "
                                             "mirrors see where, how accurately, and in which places of a room");
  command->add_option("--out", options->folder, "Folder for the files and the page")->required()->type_name("DIR");
  command->add_option("--name", options->name, "Name of the designed robot")->capture_default_str();
  add_checked(command, "--camera-deg", options->camera_deg,
              "The cameras' field of view along the image's shorter side, degrees", number_within(5, 150))
      ->group("Requirements");
  add_checked(command, "--width-px", requirements.width_px, "Width of the images", number_within(120, 16384))
      ->group("Requirements");
  add_checked(command, "--height-px", requirements.height_px, "Height of the images", number_within(120, 16384))
      ->group("Requirements");
  add_checked(command, "--lowest-deg", options->lowest_deg,
              "Lowest elevation that both mirrors shall show, degrees over the horizon", number_within(-60, 60))
      ->group("Requirements");
  add_checked(command, "--highest-deg", options->highest_deg, "Highest elevation, likewise", number_within(-60, 60))
      ->group("Requirements");
  command
      ->add_option("--floor-from-m", requirements.floor_from_m,
                   "Both mirrors shall show the floor from this distance on")
      ->check(number_within(0.1, 100))
      ->group("Requirements");
  add_checked(command, "--sigma-m", requirements.sigma_m, "Greatest sigma of a range at the distance --at-m",
              number_within(1e-6, 1e3))
      ->group("Requirements");
  add_checked(command, "--at-m", requirements.at_m, "That distance; also that of the table of tolerances",
              number_within(0.1, 100))
      ->group("Requirements");
  add_checked(command, "--sigma-px", requirements.sigma_px, "Sigma of a disparity, pixels", number_within(1e-4, 100))
      ->group("Requirements");
  add_checked(command, "--greatest-radius-m", requirements.greatest_radius_m, "Greatest radius of the mirrors",
              number_within(0.015, 10))
      ->group("Requirements");
  add_checked(command, "--greatest-height-m", requirements.greatest_height_m, "Greatest height of the robot",
              number_within(0.05, 100))
      ->group("Requirements");
  add_checked(command, "--lens-height-m", requirements.lens_height_m, "Height of the lower lens, over body and camera",
              number_within(0.01, 100))
      ->group("Requirements");
  add_checked(command, "--body-radius-m", requirements.body_radius_m, "Radius of the robot", number_within(0.01, 10))
      ->group("Requirements");
  CLI::Option* robot =
      add_robot(command, options->robot, "No design: show what this robot's pair can do (robots/lab_sim.yaml)");
  for (CLI::Option* requirement :
       command->get_options([](const CLI::Option* option) { return option->get_group() == "Requirements"; })) {
    if (requirement->get_name() != "--at-m" && requirement->get_name() != "--sigma-px") robot->excludes(requirement);
  }
  command
      ->add_option("--map", options->map,
                   "Map of the room in which the robot shall find its place (default: that of the robot, or a room "
                   "with six landmarks)")
      ->type_name("FILE");
  add_checked(command, "--edge-noise-px", options->edge_noise_px,
              "Noise of landmarks' outlines per pixel of their length, noise over contrast", number_within(1e-4, 10));
  command->add_flag("--force", options->force, "Replace files that exist");
  command->callback([options] { design_with(*options); });
}

}  // namespace twocone::cli

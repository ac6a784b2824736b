// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"
#include "apps/viewer/live_world.h"
#include "apps/viewer/loopback_cameras.h"
#include "drivers/sim_povray/effects.h"
#include "drivers/sim_povray/simulation_host.h"

namespace twocone::cli {
namespace {

// ---- effects

struct EffectsArguments {
  RobotArgument robot;
  bool verify = false;
  std::filesystem::path verify_renderer;  // folder for the images; empty: not asked for
};

/// Prints rows of columns, each as wide as its widest cell.
void print_columns(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) line += fmt::format("{:<{}}  ", row[i], widths[i]);
    line.erase(line.find_last_not_of(' ') + 1);
    fmt::print("{}\n", line);
  }
}

void print_effects(const std::vector<sim_povray::EffectRow>& effects) {
  std::vector<std::vector<std::string>> rows{{"kind", "effect", "", "reason", "cost", "switch"}};
  std::string_view kind;
  for (const sim_povray::EffectRow& effect : effects) {
    rows.push_back({effect.kind == kind ? "" : effect.kind, effect.effect, effect.on ? "on" : "-", effect.reason,
                    effect.on ? effect.cost : "", effect.how});
    kind = effect.kind;
  }
  print_columns(rows);
}

void print_verification(const std::vector<sim_povray::Verification>& results) {
  std::vector<std::vector<std::string>> rows{
      {"view", "pixels", "different", "greatest", "mean", "everything on", "as chosen", "saved"}};
  for (const sim_povray::Verification& result : results) {
    const double saved = result.everything_s > 0 ? 1 - result.choice_s / result.everything_s : 0;
    rows.push_back({result.view, std::to_string(result.pixels), std::to_string(result.different),
                    std::to_string(result.greatest), fmt::format("{:.4f}", result.mean),
                    fmt::format("{:.0f} ms", 1e3 * result.everything_s),
                    fmt::format("{:.0f} ms", 1e3 * result.choice_s),
                    result.is_time_sure ? fmt::format("{:.0f} %", 100 * saved) : "uncertain"});
  }
  fmt::print(
      "\nThe first image with everything on and as chosen: pixels in the mirror, differences of 255, and POV-Ray's\n"
      "processor time for one image (the median of three). The saving is uncertain where the two sets of three times\n"
      "overlap.\n\n");
  print_columns(rows);
  for (const sim_povray::Verification& result : results) {
    if (result.different > 0) fmt::print("\n{}: {} pixels differ: {}\n", result.view, result.different, result.why);
  }
}

/// Reports pixels that differ as a failure if neither the scene nor the map requests the difference.
void check_verification(const std::vector<sim_povray::Verification>& results) {
  for (const sim_povray::Verification& result : results) {
    if (result.different > 0 && !result.is_asked_for) {
      throw CommandFailed("effects of view {} could not be verified: {} pixels differ", result.view, result.different);
    }
  }
}

/// Compares the renderers in each view and writes where they differ.
void compare_renderers(const sim_povray::PlaceSettings& place, const sim_povray::SessionSettings& session,
                       const std::vector<sim_povray::ViewSettings>& views, const std::vector<CameraSettings>& sizes,
                       const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  fmt::print("\nThe first image, without anti-aliasing, by POV-Ray and by the native renderer:\n\n");
  std::string outcome;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto seen = value_or_fail(sim_povray::compare_renderers(place, session, views[i], sizes[i]));
    if (!seen.unknown.empty()) {
      fmt::print("{}: the native renderer does not know {}\n", seen.view, seen.unknown);
      outcome = seen.view;
      continue;
    }
    const std::filesystem::path file = folder / (seen.view + ".png");
    runlog::write_image(file, seen.differences);
    fmt::print("{}: {} of {} pixels differ by more than one level of 255; {} shows them in red\n", seen.view,
               seen.different, seen.pixels, file.string());
    if (!seen.is_trusted) outcome = seen.view;
  }
  fmt::print("\nWith --renderer auto, {}\n",
             outcome.empty() ? "the native renderer renders a plain run."
                             : fmt::format("POV-Ray renders the run, because of view {}.", outcome));
}

void effects_with(const EffectsArguments& options) {
  const config::Robot robot = options.robot.read();
  const config::Map map = config::read_map(robot.map);
  const drivers::RobotSettings settings = config::to_robot_settings(robot, map, 1);
  if (!settings.world) {
    throw CommandFailed("{}: no part has driver sim_povray: nothing is simulated", robot.file.string());
  }
  // For a served world, this is the place of the robot's map.
  const sim_povray::PlaceSettings place =
      settings.world->attach.empty() ? settings.world->place : config::to_place(map);
  const std::vector<sim_povray::ViewSettings> views = config::to_views(settings);
  print_effects(
      value_or_fail(sim_povray::effect_table(place, settings.world->session, views, config::key_places(robot, map))));
  fmt::print("\n{}\n", sim_povray::describe_confinement(place));
  std::fflush(stdout);
  std::vector<CameraSettings> sizes{settings.lower.settings, settings.upper.settings};
  for (const drivers::OtherCamera& other : settings.others) sizes.push_back(other.part.settings);
  if (!options.verify_renderer.empty()) {
    compare_renderers(place, settings.world->session, views, sizes, options.verify_renderer);
  }
  if (!options.verify) return;

  std::vector<sim_povray::Verification> results;
  ProgressBar bar("verify");
  for (std::size_t i = 0; i < views.size(); ++i) {
    bar.show(double(results.size()) / double(views.size()));
    const auto verified =
        value_or_fail(sim_povray::verify_effects(place, settings.world->session, {views[i]}, sizes[i]));
    results.insert(results.end(), verified.begin(), verified.end());
  }
  bar.remove();
  print_verification(results);
  std::fflush(stdout);
  check_verification(results);
}

// ---- serve

struct ServeArguments {
  std::filesystem::path map;
  std::string name;
  std::optional<sim_povray::RendererKind> renderer;
  bool live = false;
  viewer::PageAddress page;
  std::vector<std::string> loopback;
};

/// Reads CAMERA=DEVICE.
viewer::LoopbackCameras::Wanted loopback_of(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos || equals + 1 == text.size()) {
    throw BadUsage("--v4l2-loopback '{}' must be CAMERA=DEVICE, such as lower=/dev/video10", text);
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

/// Returns lab for scenes/lab.map.yaml.
std::string map_name(const std::filesystem::path& map) {
  const std::string file = map.filename().string();
  return file.substr(0, file.find('.'));
}

void serve_with(const ServeArguments& options) {
  config::Map map = config::read_map(options.map);
  if (options.renderer) map.renderer = *options.renderer;
  const sim_povray::PlaceSettings place = config::to_place(map);

  // After a signal every robot's wheels stop and the name becomes free.
  const std::atomic<bool>& stop = stop_on_signals();

  const std::string name = options.name.empty() ? map_name(options.map) : options.name;
  std::optional<viewer::LiveWorld> live;
  if (options.live) {
    live.emplace(map, name);
    say(fmt::format("watch at {}", value_or_fail(live->open(options.page))));
  }
  sim_povray::WorldWatch watch = live ? live->watch() : sim_povray::WorldWatch();
  std::unique_ptr<viewer::LoopbackCameras> devices;
  if (!options.loopback.empty()) {
    std::vector<viewer::LoopbackCameras::Wanted> wanted;
    for (const std::string& text : options.loopback) wanted.push_back(loopback_of(text));
    devices = value_or_fail(viewer::LoopbackCameras::open(wanted, [](const std::string& line) { say(line); }));
    watch.ordered = [shown = watch.ordered, &devices](const std::string& robot, const std::string& camera,
                                                      const std::shared_future<ImageResult>& image) {
      if (shown) shown(robot, camera, image);
      devices->ordered(robot, camera, image);
    };
  }
  const Status served = sim_povray::serve_world(
      place, name, [](const std::string& line) { say(line); }, stop, watch);
  if (!served) throw CommandFailed(served.error().message);
}

}  // namespace

void add_effects(CLI::App& program) {
  auto options = std::make_shared<EffectsArguments>();
  CLI::App* command =
      program.add_subcommand("effects", "List the effects that scene, map and robot use, why, and what they cost");
  add_robot(command, options->robot, "Robot file (robots/lab_sim.yaml)")->required();
  command->add_flag("--verify", options->verify,
                    "Render the first image with everything on and as chosen; compare pixels and time");
  command
      ->add_option("--verify-renderer", options->verify_renderer,
                   "Render the first image with POV-Ray and with the native renderer; count the pixels that differ "
                   "and write where they do into this folder")
      ->type_name("DIR");
  command->callback([options] { effects_with(*options); });
}

void add_serve(CLI::App& program) {
  auto options = std::make_shared<ServeArguments>();
  CLI::App* command =
      program.add_subcommand("serve", "Run a simulated world for several robots or programs, until it is interrupted");
  command->add_option("--scene", options->map, "Map file of the place (scenes/lab.map.yaml)")->required();
  command->add_option("--name", options->name, "Name for `attach:` of robot files (default: the map file's name)");
  add_renderer(command, options->renderer);
  add_live(command, options->live, options->page,
           "Show the world with its robots in a browser, and print the page's address. PORT: any that is free");
  command
      ->add_option("--v4l2-loopback", options->loopback,
                   "CAMERA=DEVICE: write what a robot's camera sees into a device of the kernel module v4l2loopback,\n"
                   "such as lower=/dev/video10, or robot.2.lower=... where there are several robots; can be repeated")
      ->type_name("CAMERA=DEVICE");
  command->callback([options] { serve_with(*options); });
}

}  // namespace twocone::cli

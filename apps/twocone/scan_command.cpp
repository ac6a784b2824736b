// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>
#include <numbers>

#include <fmt/format.h>

#include "apps/scan/scan.h"
#include "apps/twocone/commands.h"

namespace twocone::cli {
namespace {

struct ScanArguments {
  std::filesystem::path run;
  scan::ScanOptions options;
};

void scan_with(const ScanArguments& arguments) {
  scan::ScanOptions options = arguments.options;
  if (!(options.settings.low_m < options.settings.high_m)) {
    throw BadUsage("--low-m {} and --high-m {}: the first must be less", options.settings.low_m,
                   options.settings.high_m);
  }
  options.stop = &stop_on_signals();
  ProgressBar bar("frames");
  options.progress = [&bar](double done) { bar.show(done); };
  const auto counts =
      value_or_interrupted(scan::scan(arguments.run, options), fmt::format("{} is as it was", arguments.run.string()));
  bar.remove();
  const double beams = double(counts.unknown + counts.free + counts.occupied);
  fmt::print("{} frames, {:.0f} ranges each; of the beams {:.0f} % occupied, {:.0f} % free, {:.0f} % unknown\n",
             counts.frames, double(counts.points) / counts.frames, 100 * double(counts.occupied) / beams,
             100 * double(counts.free) / beams, 100 * double(counts.unknown) / beams);
  if (counts.without_images > 0) fmt::print("{} frames were left out: they have no images\n", counts.without_images);
  if (options.plan) {
    fmt::print("{} of {} frames placed by the floor plan", counts.placed, counts.frames);
    if (counts.position_error_m) {
      fmt::print(
          ": errors {:.1f} mm and {:.3f} degrees (means); 95 % regions hold {:.0f} % of positions and {:.0f} % of "
          "headings",
          1000 * *counts.position_error_m, *counts.heading_error_rad * 180 / std::numbers::pi,
          100 * *counts.position_held, 100 * *counts.heading_held);
    }
    fmt::print("\n");
  }
  fmt::print("written    {}\n", scan::scan_file(arguments.run).string());
  if (counts.clouds > 0) fmt::print("           {} clouds in {}\n", counts.clouds, (arguments.run / "clouds").string());
}

}  // namespace

void add_scan(CLI::App& program) {
  auto arguments = std::make_shared<ScanArguments>();
  scan::ScanOptions& options = arguments->options;
  CLI::App* command = program.add_subcommand(
      "scan", "Range everything that has texture in a run's images: scan.csv with the nearest thing of each degree");
  command->add_option("RUN", arguments->run, "Run folder")->required();
  command->add_flag("--clouds", options.clouds, "Also write a point cloud for each frame, clouds/FRAME.ply");
  command->add_flag("--plan", options.plan,
                    "Also place each frame by the walls and obstacles of the run's map, without landmarks: plan.csv");
  add_checked(command, "--every", options.every, "Use every such frame", number_within(1, 1e6));
  add_checked(command, "--beams", options.settings.beams, "Beams of a turn", number_within(1, 100000));
  add_checked(command, "--low-m", options.settings.low_m, "What ends below this height is floor",
              number_within(-10, 10));
  add_checked(command, "--high-m", options.settings.high_m, "What begins above this height is passed under",
              number_within(-10, 100));
  command->callback([arguments] { scan_with(*arguments); });
}

}  // namespace twocone::cli

// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "apps/recording/recording.h"
#include "apps/twocone/commands.h"

namespace twocone::cli {
namespace {

struct ExportArguments {
  std::filesystem::path run, mcap;
  bool force = false;
};

void export_with(const ExportArguments& arguments) {
  if (!arguments.force) refuse_overwriting({arguments.mcap});
  ProgressBar bar("export");
  const auto counts = recording::export_run(arguments.run, arguments.mcap, [&bar](double done) { bar.show(done); });
  bar.remove();
  fmt::print("{} frames in {} messages\nwritten    {}\n", counts.frames, counts.messages, arguments.mcap.string());
  if (counts.without_images > 0) fmt::print("{} frames lack an image\n", counts.without_images);
}

}  // namespace

void add_export(CLI::App& program) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command = program.add_subcommand("export", "Write a run as an MCAP file, for Foxglove and other tools");
  command->add_option("RUN", arguments->run, "Run folder")->required();
  command->add_option("--mcap", arguments->mcap, "File to write")->required();
  command->add_flag("--force", arguments->force, "Replace a file that exists");
  command->callback([arguments] { export_with(*arguments); });
}

}  // namespace twocone::cli

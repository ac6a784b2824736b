// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "apps/report/table.h"
#include "apps/runs/run.h"
#include "apps/runs/summary.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/progress_bar.h"

namespace twocone::cli {
namespace {

struct Options {
  std::filesystem::path folder;
  std::string method = "paper";
};

void execute(const Options& options) {
  std::optional<runs::RunData> data;
  {
    ProgressBar bar("localise");
    data = value_or_fail(
        runs::localise(options.folder, runs::method_named(options.method), [&bar](double done) { bar.show(done); }));
  }
  fmt::print("{}", report::table(runs::summarise(*data), data->info, data->robot));
}

}  // namespace

void add_localise(CLI::App& program) {
  auto options = std::make_shared<Options>();
  CLI::App* command = program.add_subcommand("localise", "Ranges and fixes again, offline, from a run's stored frames");
  command->add_option("DIR", options->folder, "Run folder")->required();
  command->add_option("--method", options->method, "How to range and localise: paper")
      ->check(CLI::IsMember({"paper"}))
      ->capture_default_str();
  command->callback([options] { execute(*options); });
}

}  // namespace twocone::cli

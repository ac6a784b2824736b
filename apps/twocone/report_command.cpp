// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "apps/report/report.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"

namespace twocone::cli {
namespace {

void report_with(const std::filesystem::path& folder) {
  (void)runlog::read_run_yaml(folder);  // without a run there is no lock
  // If another program writes the run, its present state is read, and that program writes the summary.
  const auto lock = runlog::RunLock::try_take(folder);
  const runlog::RunData data = runlog::read_run(folder);
  if (lock) runlog::write_summary(data);
  std::vector<std::string> notes;  // not printed, because write_report returns the same notes
  fmt::print("{}", report::table_of(data, notes));
  std::fflush(stdout);
  ProgressBar bar("report");
  report::ReportSettings settings;
  settings.progress = [&bar](double done) { bar.show(done); };
  const report::ReportResult result = value_or_fail(report::write_report(data, settings));
  bar.remove();
  for (const std::string& note : result.notes) say(fmt::format("note: {}", note));
  fmt::print("\nreport  {}\n", result.html.string());
}

}  // namespace

void add_report(CLI::App& program) {
  auto folder = std::make_shared<std::filesystem::path>();
  CLI::App* command = program.add_subcommand("report", "Tables and figures of a run, as one page: DIR/report.html");
  command->add_option("DIR", *folder, "Run folder, also of a run that was cut off")->required();
  command->callback([folder] { report_with(*folder); });
}

}  // namespace twocone::cli

// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"
#include "apps/viewer/stored_runs.h"

namespace twocone::cli {
namespace {

constexpr int kMostPort = 65'535;

struct ViewArguments {
  std::vector<std::filesystem::path> folders;
  viewer::PageAddress page;
};

void add_address(CLI::App* command, viewer::PageAddress& page) {
  add_checked(command, "--live-address", page.address,
              "Address of the interface on which the page is served. Other than 127.0.0.1, everybody who has the\n"
              "page's address can read it on its way: there is no TLS",
              CLI::ValidIPV4);
}

void view_with(const ViewArguments& options) {
  std::vector<std::filesystem::path> runs = viewer::find_runs(options.folders);
  const std::size_t count = runs.size();
  const std::atomic<bool>& stop = stop_on_signals();
  viewer::StoredRuns site(std::move(runs));
  const std::string address = value_or_fail(site.open(options.page));
  say(fmt::format("{} {} at {}; Ctrl-C ends it", count, count == 1 ? "run" : "runs", address));
  while (!stop) std::this_thread::sleep_for(std::chrono::milliseconds(100));
}

}  // namespace

void add_live(CLI::App* command, bool& live, viewer::PageAddress& page, const std::string& text) {
  command
      ->add_option_function<std::vector<std::string>>(
          "--live",
          [&live, &page](const std::vector<std::string>& port) {
            live = true;
            if (!port.empty() && !port.front().empty() && !CLI::detail::lexical_cast(port.front(), page.port)) {
              throw CLI::ValidationError("--live", fmt::format("'{}' is no port", port.front()));
            }
          },
          text)
      ->expected(0, 1)
      ->type_name("[PORT]");
  add_address(command, page);
}

void add_view(CLI::App& program) {
  auto options = std::make_shared<ViewArguments>();
  CLI::App* command =
      program.add_subcommand("view", "Show stored runs in a browser, frame by frame, until interrupted");
  command->add_option("DIR", options->folders, "Run folders, or folders with runs in them")->required();
  add_checked(command, "--port", options->page.port, "Port of the page; 0: any that is free", CLI::Range(0, kMostPort));
  add_address(command, options->page);
  command->callback([options] { view_with(*options); });
}

}  // namespace twocone::cli

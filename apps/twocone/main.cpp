// SPDX-License-Identifier: Apache-2.0
#include <exception>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/runs/version.h"
#include "apps/twocone/commands.h"

namespace {

constexpr int kFailed = 1;
constexpr int kBadUsage = 2;

int complain(const char* what, int status) {
  fmt::print(stderr, "twocone: {}\n", what);
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App program{"twocone: a robot that sees all round with two cone mirrors, simulated or real", "twocone"};
  program.set_version_flag("--version", fmt::format("twocone {} ({}) {}", twocone::runs::version(),
                                                    twocone::runs::commit(), twocone::runs::compiler()));
  program.require_subcommand(1);
  try {
    twocone::cli::add_run(program);
    twocone::cli::add_localise(program);
    twocone::cli::add_report(program);
    program.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return program.exit(asked);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "twocone: {} (twocone --help tells more)\n", error.what());
    return kBadUsage;
  } catch (const twocone::cli::BadUsage& error) {
    return complain(error.what(), kBadUsage);
  } catch (const std::exception& error) {
    return complain(error.what(), kFailed);
  }
  return 0;
}

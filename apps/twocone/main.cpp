// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <exception>
#include <string>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/runs/version.h"
#include "apps/twocone/commands.h"

namespace {

constexpr int kFailed = 1;
constexpr int kBadUsage = 2;

int complain(const char* what, int status) noexcept {
  std::fputs("twocone: ", stderr);
  std::fputs(what, stderr);
  std::fputs("\n", stderr);
  return status;
}

/// CLI11 would only say that a subcommand is required.
void check_subcommand(const CLI::App& program, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  std::string known;
  for (const CLI::App* command : program.get_subcommands({})) {
    if (command->get_name() == argv[1]) return;
    known += (known.empty() ? "" : ", ") + command->get_name();
  }
  throw twocone::cli::BadUsage(fmt::format("no subcommand '{}'; there are: {}", argv[1], known));
}

int run_program(int argc, char** argv) {
  CLI::App program{"twocone: a robot that sees all round with two cone mirrors, simulated or real", "twocone"};
  program.set_version_flag("--version", fmt::format("twocone {} ({}) {}", twocone::runs::version(),
                                                    twocone::runs::commit(), twocone::runs::compiler()));
  program.require_subcommand(1);
  twocone::cli::add_run(program);
  twocone::cli::add_localise(program);
  twocone::cli::add_report(program);
  twocone::cli::add_serve(program);
  twocone::cli::add_effects(program);
  twocone::cli::add_calibrate(program);
  twocone::cli::add_import(program);
  twocone::cli::add_devices(program);
  twocone::cli::add_doctor(program);
  twocone::cli::add_tradeoff(program);
  twocone::cli::add_compare(program);
  try {
    check_subcommand(program, argc, argv);
    program.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return program.exit(asked);
  } catch (const CLI::ParseError& error) {
    return complain(fmt::format("{} (twocone --help tells more)", error.what()).c_str(), kBadUsage);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run_program(argc, argv);
  } catch (const twocone::cli::BadUsage& error) {
    return complain(error.what(), kBadUsage);
  } catch (const std::exception& error) {
    return complain(error.what(), kFailed);
  } catch (...) {
    return complain("something was thrown that is no exception", kFailed);
  }
}

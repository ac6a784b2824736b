// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/runlog/version.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"

namespace cli = twocone::cli;

namespace {

constexpr int kFailed = 1;
constexpr int kBadUsage = 2;
constexpr int kUndecided = 3;
constexpr int kSignalled = 128;  // plus the signal's number, as a shell reports it

int complain(const char* what, int status) noexcept {
  std::fputs("twocone: ", stderr);
  std::fputs(what, stderr);
  std::fputs("\n", stderr);
  return status;
}

int run_program(int argc, char** argv) {
  CLI::App program{"twocone: a robot that sees in all directions with two cone mirrors, simulated or real", "twocone"};
  program.set_version_flag("--version", fmt::format("twocone {} ({}) {}", twocone::runlog::version(),
                                                    twocone::runlog::commit(), twocone::runlog::compiler()));
  program.require_subcommand(1);
  program.formatter(std::make_shared<cli::HelpFormatter>());  // subcommands inherit it
  for (const auto add :
       {cli::add_run,       cli::add_localise,  cli::add_report,   cli::add_view,     cli::add_serve,
        cli::add_effects,   cli::add_new,       cli::add_as_built, cli::add_design,   cli::add_print_bands,
        cli::add_look,      cli::add_calibrate, cli::add_survey,   cli::add_scan,     cli::add_export,
        cli::add_import,    cli::add_devices,   cli::add_doctor,   cli::add_tradeoff, cli::add_compare,
        cli::add_log_level, cli::add_help}) {
    add(program);
  }
  try {
    // An unknown subcommand is named; CLI11 would only report that one is required.
    if (argc > 1 && argv[1][0] != '-') static_cast<void>(cli::subcommand_named(program, argv[1]));
    program.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return program.exit(asked);
  } catch (const CLI::ParseError& error) {
    return complain(cli::explain(program, error).c_str(), kBadUsage);
  }
  return 0;
}

int run_and_catch(int argc, char** argv) {
  try {
    return run_program(argc, argv);
  } catch (const cli::BadUsage& error) {
    return complain(error.what(), kBadUsage);
  } catch (const cli::Undecided& error) {
    return complain(error.what(), kUndecided);
  } catch (const cli::Interrupted& stopped) {
    return complain(stopped.what(), kSignalled + cli::stop_signal());
  } catch (const std::exception& error) {
    // main() names the stream that could not be written.
    if (std::ferror(stdout) != 0) return kFailed;
    return complain(error.what(), kFailed);
  } catch (...) {
    return complain("an unknown exception was thrown", kFailed);
  }
}

}  // namespace

int main(int argc, char** argv) {
  cli::open_missing_streams();
  const int status = run_and_catch(argc, argv);
  const std::string lost = cli::lost_output();
  return lost.empty() ? status : complain(lost.c_str(), status == 0 ? kFailed : status);
}

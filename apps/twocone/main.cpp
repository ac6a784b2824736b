// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/runlog/version.h"
#include "apps/twocone/command_line.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/standard_streams.h"

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

/// Names the unknown subcommand. CLI11 would only report that a subcommand is required.
void check_subcommand(const CLI::App& program, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  const auto named = program.get_subcommands([&](const CLI::App* c) { return c->get_name() == argv[1]; });
  if (named.empty()) throw twocone::cli::BadUsage(twocone::cli::no_such_subcommand(program, argv[1]));
}

int run_program(int argc, char** argv) {
  CLI::App program{"twocone: a robot that sees in all directions with two cone mirrors, simulated or real", "twocone"};
  program.set_version_flag("--version", fmt::format("twocone {} ({}) {}", twocone::runlog::version(),
                                                    twocone::runlog::commit(), twocone::runlog::compiler()));
  program.require_subcommand(1);
  program.formatter(std::make_shared<twocone::cli::HelpFormatter>());  // subcommands inherit it
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
  twocone::cli::add_log_level(program);
  twocone::cli::add_help(program);
  try {
    check_subcommand(program, argc, argv);
    program.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return program.exit(asked);
  } catch (const CLI::ParseError& error) {
    return complain(twocone::cli::explain(program, error).c_str(), kBadUsage);
  }
  return 0;
}

int run_and_catch(int argc, char** argv) {
  try {
    return run_program(argc, argv);
  } catch (const twocone::cli::BadUsage& error) {
    return complain(error.what(), kBadUsage);
  } catch (const twocone::cli::Undecided& error) {
    return complain(error.what(), kUndecided);
  } catch (const twocone::cli::Interrupted& stopped) {
    return complain(stopped.what(), kSignalled + twocone::cli::stop_signal());
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
  twocone::cli::open_missing_streams();
  const int status = run_and_catch(argc, argv);
  const std::string lost = twocone::cli::lost_output();
  return lost.empty() ? status : complain(lost.c_str(), status == 0 ? kFailed : status);
}

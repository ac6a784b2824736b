// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "apps/config/robot_file.h"
#include "apps/twocone/terminal.h"
#include "base/errors.h"
#include "drivers/sim_povray/place.h"
#include "hal/result.h"

namespace twocone::viewer {
struct PageAddress;
}

/// The subcommands of twocone and their common parts.
namespace twocone::cli {

/// A subcommand failed. The message has one or more lines for the user. main() prints them and exits with 1.
struct CommandFailed : base::FormattedError {
  using Formatted::Formatted;
};

/// The work is done, but the data do not decide the question. main() prints the message and exits with 3.
struct Undecided : base::FormattedError {
  using Formatted::Formatted;
};

/// A signal ended the work in good order. The message names the remaining files and the next step. main() prints the
/// line and exits with 128 plus the signal's number, as a shell does.
struct Interrupted : base::FormattedError {
  using Formatted::Formatted;
};

/// The call itself is wrong. main() prints the line and exits with 2.
struct BadUsage : base::FormattedError {
  using Formatted::Formatted;
};

/// Returns the value. @throws CommandFailed with the error's message
template <typename T>
T value_or_fail(Result<T> result) {
  if (!result) throw CommandFailed(result.error().message);
  return std::move(*result);
}

/// Like value_or_fail. @throws Interrupted with `next` if a signal ended the work
template <typename T>
T value_or_interrupted(Result<T> result, const std::string& next) {
  if (!result && stop_signal() != 0) throw Interrupted(next);
  return value_or_fail(std::move(result));
}

/// @throws CommandFailed if one of the files exists
inline void refuse_overwriting(const std::vector<std::filesystem::path>& files) {
  for (const auto& file : files) {
    if (std::filesystem::exists(file)) throw CommandFailed("{} exists: --force replaces it", file.string());
  }
}

// ---- parts of the command line that CLI11 lacks or explains less clearly

/// Prints help whose usage line shows optional words in brackets: RUN [RUN].
class HelpFormatter final : public CLI::Formatter {
 public:
  std::string make_option_usage(const CLI::Option* option) const override;
};

/// Returns one line about a call that CLI11 rejected: the fault, the option that was probably meant, and the command
/// whose --help explains it.
/// @param program after its parse() has thrown `error`
[[nodiscard]] std::string explain(const CLI::App& program, const CLI::ParseError& error);

/// Returns the subcommand of that name. @throws BadUsage with one line that names the one that was probably meant and
/// all existing ones
[[nodiscard]] const CLI::App& subcommand_named(const CLI::App& program, const std::string& name);

/// Adds the subcommand help [COMMAND], which prints what COMMAND --help prints.
void add_help(CLI::App& program);

/// Adds the option --log-level to the subcommands that open devices or take long. Requires that they exist already.
void add_log_level(CLI::App& program);

/// Adds --renderer.
CLI::Option* add_renderer(CLI::App* command, std::optional<sim_povray::RendererKind>& kind);

/// The robot that a command line names.
struct RobotArgument {
  std::filesystem::path file;
  std::vector<std::string> changes;  ///< KEY=VALUE

  /// @throws config::FileError as config::parse_change and config::read_robot
  [[nodiscard]] config::Robot read() const;
};

/// Adds --robot and --set. Returns --robot.
CLI::Option* add_robot(CLI::App* command, RobotArgument& robot, const std::string& text);

/// Adds an option with a check. --help shows its default value.
template <typename Value>
CLI::Option* add_checked(CLI::App* command, const std::string& name, Value& value, const std::string& text,
                         const CLI::Validator& check) {
  return command->add_option(name, value, text)->check(check)->capture_default_str();
}

/// Adds --live [PORT] and --live-address. @param live,page must outlive the parsing
void add_live(CLI::App* command, bool& live, viewer::PageAddress& page, const std::string& text);

/// Accepts whole numbers from 0 to 2^64 - 1, in digits. Without this check, -1 would be read as 2^64 - 1.
[[nodiscard]] CLI::Validator whole_number();

/// Accepts numbers from `least` to `greatest`. Unlike CLI::Range it rejects nan.
[[nodiscard]] CLI::Validator number_within(double least, double greatest);

/// Accepts names of methods of ranging and localisation. An old name is rejected with the present one.
[[nodiscard]] CLI::Validator is_method();

// ---- the subcommands. Each function adds one with its options to the program. CLI11 runs its callback

void add_run(CLI::App& program);
void add_localise(CLI::App& program);
void add_report(CLI::App& program);
void add_view(CLI::App& program);
void add_serve(CLI::App& program);
void add_effects(CLI::App& program);
void add_look(CLI::App& program);
void add_calibrate(CLI::App& program);
void add_survey(CLI::App& program);
void add_import(CLI::App& program);
void add_devices(CLI::App& program);
void add_doctor(CLI::App& program);
void add_tradeoff(CLI::App& program);
void add_compare(CLI::App& program);
void add_new(CLI::App& program);
void add_design(CLI::App& program);
void add_scan(CLI::App& program);
void add_export(CLI::App& program);
void add_print_bands(CLI::App& program);
void add_as_built(CLI::App& program);

}  // namespace twocone::cli

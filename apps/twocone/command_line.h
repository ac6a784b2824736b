// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <CLI/CLI.hpp>

/// Parts of the command line that CLI11 lacks or explains less clearly.
namespace twocone::cli {

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

/// Adds the option --log-level to the subcommands that open devices or take long. They must be there already.
void add_log_level(CLI::App& program);

/// Adds an option with a check. --help shows its default value.
template <typename Value>
CLI::Option* add_checked(CLI::App* command, const std::string& name, Value& value, const std::string& text,
                         const CLI::Validator& check) {
  return command->add_option(name, value, text)->check(check)->capture_default_str();
}

/// Accepts whole numbers from 0 to 2^64 - 1, in digits. Without this check, -1 would be read as 2^64 - 1.
[[nodiscard]] CLI::Validator whole_number();

/// Accepts numbers from `least` to `greatest`. Unlike CLI::Range it rejects nan.
[[nodiscard]] CLI::Validator number_within(double least, double greatest);

/// Accepts names of methods of ranging and localisation. An old name is rejected with the present one.
[[nodiscard]] CLI::Validator is_method();

}  // namespace twocone::cli

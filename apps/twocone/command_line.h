// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

/// What CLI11 does not say, or says less clearly.
namespace twocone::cli {

/// Help whose usage line shows optional words in brackets: RUN [RUN].
class HelpFormatter final : public CLI::Formatter {
 public:
  std::string make_option_usage(const CLI::Option* option) const override;
};

/// One line about a call that CLI11 refused: what is wrong, the option that was probably meant, and whose --help to
/// read.
/// @param program after its parse() has thrown `error`
[[nodiscard]] std::string explain(const CLI::App& program, const CLI::ParseError& error);

/// One line about a subcommand that does not exist, with the one that was probably meant and all there are.
[[nodiscard]] std::string no_such_subcommand(const CLI::App& program, std::string_view word);

/// Adds the subcommand help [COMMAND], which prints what COMMAND --help prints.
void add_help(CLI::App& program);

/// A whole number from 0 to 2^64 - 1, in digits: without this check, -1 would be read as 2^64 - 1.
[[nodiscard]] CLI::Validator whole_number();

/// A number from `least` to `greatest`. Unlike CLI::Range it refuses nan.
[[nodiscard]] CLI::Validator number_within(double least, double greatest);

}  // namespace twocone::cli

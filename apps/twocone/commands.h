// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/config/yaml/text_file.h"
#include "apps/twocone/terminal.h"
#include "base/errors.h"
#include "hal/result.h"

/// The subcommands. Each function adds a subcommand with its options to the program. The callback runs it.
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

void add_run(CLI::App& program);
void add_localise(CLI::App& program);
void add_report(CLI::App& program);
void add_serve(CLI::App& program);
void add_effects(CLI::App& program);
void add_calibrate(CLI::App& program);
void add_import(CLI::App& program);
void add_devices(CLI::App& program);
void add_doctor(CLI::App& program);
void add_tradeoff(CLI::App& program);
void add_compare(CLI::App& program);

}  // namespace twocone::cli

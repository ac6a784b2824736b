// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

#include <CLI/CLI.hpp>

#include "hal/result.h"

/// The subcommands. Each adds itself and its options to the program; its callback runs it.
namespace twocone::cli {

/// A subcommand could not do its work: one or more lines for the person. main() prints them and exits with 1.
class CommandFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// All was done, but the data do not tell what was asked: main() prints the lines and exits with 3.
class CannotTell : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The call itself is wrong: main() prints the line and exits with 2.
class BadUsage : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The value, or CommandFailed with the error's message.
template <typename T>
T value_or_fail(Result<T> result) {
  if (!result) throw CommandFailed(result.error().message);
  return std::move(*result);
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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

/// Standard output holds results, standard error all other messages.
namespace twocone::cli {

/// Opens /dev/null in place of standard input, output and error if the caller has closed them, in a mode in which each
/// use still fails. Otherwise the first files that the program opens would take their numbers and receive printed text.
void open_missing_streams() noexcept;

/// Writes a line to standard error. It never throws, so that a drive does not end because of its messages.
/// lost_output() reports a failure.
void say(const std::string& line) noexcept;

/// Returns the first failure: "cannot write to standard output: No space left on device"; empty: all was written.
[[nodiscard]] std::string lost_output();

}  // namespace twocone::cli

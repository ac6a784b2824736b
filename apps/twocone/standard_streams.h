// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

/// Standard output holds results, standard error all other messages.
namespace twocone::cli {

/// Of standard input, output and error those that the caller has closed become /dev/null, open such that each use of
/// them fails as before. Else the first files that are opened would take their numbers, and be printed into.
void open_missing_streams() noexcept;

/// Writes a line to standard error. Never throws, so that no drive ends because nobody can read about it: a failure is
/// noticed by lost_output().
void say(const std::string& line) noexcept;

/// What was not written: "cannot write to standard output: No space left on device"; empty: all was written.
[[nodiscard]] std::string lost_output();

}  // namespace twocone::cli

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "hal/result.h"

namespace twocone::report {

/// What a program wrote until it ended by itself.
struct ProgramOutput {
  int exit_code = 0;
  std::string out;
  std::string err;
};

/// Runs a program without a shell and waits for its end, at most `timeout`; its standard input is empty. Whatever this
/// function returns, the child has ended and is reaped.
/// @param program a path, or a name looked up in PATH
/// Errors: kUnavailable (cannot be started), kTimeout (killed), kDisconnected (ended by a signal), kBadData (killed
/// because it wrote more than any figure needs).
Result<ProgramOutput> run_program(const std::string& program, const std::vector<std::string>& arguments,
                                  std::chrono::milliseconds timeout);

}  // namespace twocone::report

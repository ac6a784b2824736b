// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace twocone::base {

/// Loads a module of this program, a shared library with what few robots need, and returns its function `entry`. It is
/// looked for in the folder TWOCONE_MODULES (environment), beside the program, and where the program was installed. It
/// is never closed, because its threads may outlive its use.
/// @param file its name; it holds the version, so that two installed versions do not load each other's module
/// @throws base::FormattedError
void* load_module(const char* file, const char* entry);

}  // namespace twocone::base

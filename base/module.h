// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace twocone::base {

/// Returns the path of a module of this program: a shared library or a program with what few robots need. It is looked
/// for in the folder TWOCONE_MODULES (environment), and in lib/twocone of the folders above the program and above the
/// shared library that holds this function, because a program of another prefix may load the library.
/// @param file its name; it holds the version, so that two installed versions do not use each other's module
/// @throws base::FormattedError
std::filesystem::path find_module(const char* file);

/// Loads a module that is a shared library, and returns its function `entry`. It is never closed, because its threads
/// may outlive its use. @throws base::FormattedError
void* load_module(const char* file, const char* entry);

}  // namespace twocone::base

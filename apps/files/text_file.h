// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace twocone::files {

/// The whole of a regular file, byte for byte.
/// @throws FileError, one line: no such file, a folder, no regular file (a pipe could block for ever), not readable
std::string read_text(const std::filesystem::path& file);

/// `path` as written in `file`: relative paths start at the file's folder. `..` is folded away where that leaves the
/// meaning alone, which it does not behind a symbolic link to a folder.
std::filesystem::path resolve(const std::filesystem::path& path, const std::filesystem::path& file);

}  // namespace twocone::files

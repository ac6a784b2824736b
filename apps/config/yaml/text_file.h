// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"

namespace twocone::config {

/// A file that cannot be used. The message has one line for each bad key: "robots/lab.yaml:7: drive.wheel_radius_m is
/// -0.05 m, must be > 0".
struct FileError : base::FormattedError {
  using Formatted::Formatted;
};

/// @throws FileError always, about one line of a file: "FILE:LINE: WHAT"
template <typename... Values>
[[noreturn]] void refuse_line(const std::filesystem::path& file, std::size_t line, fmt::format_string<Values...> what,
                              Values&&... values) {
  throw FileError("{}:{}: {}", file.string(), line, fmt::format(what, std::forward<Values>(values)...));
}

/// Returns the content of a regular file, byte for byte.
/// @throws FileError with one line: the file does not exist, is a folder, is not a regular file (a pipe could block for
/// ever), or is not readable
std::string read_text(const std::filesystem::path& file);

/// Returns the path of `target`, which is absolute, as `file` must write it: relative to its folder where possible.
std::string relative_to(const std::filesystem::path& file, const std::filesystem::path& target);

/// Reads a file line by line, and holds one block in memory. Text after the last newline is not returned, because a
/// program ended while it wrote that line.
class TextLines {
 public:
  /// @throws FileError as read_text
  explicit TextLines(const std::filesystem::path& file);

  /// Returns the next line without its newline, or nothing at the end. @throws FileError if reading fails
  std::optional<std::string> next();
  /// Returns the number of the line that next() returned last, from 1.
  [[nodiscard]] std::size_t number() const { return number_; }

 private:
  std::filesystem::path file_;
  std::ifstream stream_;
  std::size_t number_ = 0;
};

/// Resolves `path` as written in `file`. Relative paths start at the file's folder. `..` is removed unless this changes
/// the meaning, as it does after a symbolic link to a folder.
std::filesystem::path resolve(const std::filesystem::path& path, const std::filesystem::path& file);

}  // namespace twocone::config

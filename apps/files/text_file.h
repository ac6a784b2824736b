// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace twocone::files {

/// The whole of a regular file, byte for byte.
/// @throws FileError, one line: no such file, a folder, no regular file (a pipe could block for ever), not readable
std::string read_text(const std::filesystem::path& file);

/// A file's lines, one after the other; in memory is one block. What follows the last newline was being written when a
/// program ended, and is not handed out.
class TextLines {
 public:
  /// @throws FileError as read_text
  explicit TextLines(const std::filesystem::path& file);

  /// The next line, without its newline; nothing at the end. @throws FileError where the file cannot be read on
  std::optional<std::string> next();
  /// Of the line last handed out, from 1.
  [[nodiscard]] std::size_t number() const { return number_; }

 private:
  std::filesystem::path file_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream_;
  std::string block_;
  std::size_t at_ = 0;  ///< in block_, where the next line begins
  std::size_t number_ = 0;
};

/// `path` as written in `file`: relative paths start at the file's folder. `..` is folded away where that leaves the
/// meaning alone, which it does not behind a symbolic link to a folder.
std::filesystem::path resolve(const std::filesystem::path& path, const std::filesystem::path& file);

}  // namespace twocone::files

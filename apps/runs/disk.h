// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string_view>

namespace twocone::runs {

/// The disk would not take what a run has to tell. One line: what could not be written, and why.
class DiskError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Writes the whole file or none: into a neighbour, then renamed. @throws DiskError
void write_whole(const std::filesystem::path& file, std::string_view content);

/// `to`, which is not there yet, as a hard link to `from`; a copy where the disk has no links, or is another one. Its
/// folder is made. @throws DiskError
void link_or_copy(const std::filesystem::path& from, const std::filesystem::path& to);

/// A new or emptied file that grows line by line; every line is in the file once add() returns, so that a killed
/// program loses none of them.
class LineFile {
 public:
  /// @throws DiskError
  explicit LineFile(const std::filesystem::path& file);
  ~LineFile();
  LineFile(LineFile&& other) noexcept;
  LineFile& operator=(LineFile&&) = delete;

  /// @param line without the newline. @throws DiskError
  void add(std::string_view line);

 private:
  std::filesystem::path file_;
  int descriptor_;
};

}  // namespace twocone::runs

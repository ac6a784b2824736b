// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "apps/files/text_file.h"

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

/// What a LineFile does with the whole lines that its file has already.
enum class OldLines {
  kDrop,
  kKeep,  ///< add() passes over them, one by one, before it writes: so the file is never shorter than it was
};

/// How far a line that is added again must equal the one that was kept.
enum class Equal {
  kWhole,
  kButLastField,  ///< of a CSV table
  kNot,           ///< it may be another: it tells what the machine did
};

/// A file that grows line by line; every line is in the file once add() returns, so that a killed program loses none of
/// them.
class LineFile {
 public:
  /// A last line without its newline is no whole line, and is written anew. @throws DiskError
  explicit LineFile(const std::filesystem::path& file, OldLines old = OldLines::kDrop);
  ~LineFile();
  LineFile(LineFile&& other) noexcept;
  LineFile& operator=(LineFile&&) = delete;

  /// @param line without the newline. @throws DiskError; also where a kept line is not this one as far as `equal` asks
  void add(std::string_view line, Equal equal = Equal::kWhole);

 private:
  [[nodiscard]] bool pass_over(std::string_view line, Equal equal);

  std::filesystem::path file_;
  std::optional<files::TextLines> kept_;
  std::size_t kept_bytes_ = 0;
  int descriptor_;
};

}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "apps/config/yaml/text_file.h"
#include "base/errors.h"
#include "base/unique_fd.h"

namespace twocone::runlog {

/// Reports that the disk did not accept data of a run. The message is one line: the file and the reason.
struct DiskError : base::FormattedError {
  using Formatted::Formatted;
};

/// Creates a folder and those above it. @throws DiskError
void make_folder(const std::filesystem::path& folder);

/// Removes a file or a folder, if there is one. @throws DiskError
void remove_whole(const std::filesystem::path& path);

/// Writes the whole file or nothing, by means of a temporary file beside it and a rename. @throws DiskError
void write_whole(const std::filesystem::path& file, std::string_view content);

/// Makes `to`, which must not exist yet, a hard link to `from`. It copies the file if the disk has no links or is
/// another one. It creates the folder of `to`. @throws DiskError
void link_or_copy(const std::filesystem::path& from, const std::filesystem::path& to);

/// The handling of complete lines that a LineFile finds in its file.
enum class OldLines {
  kDrop,
  kKeep,  ///< add() compares and skips them one by one before it writes, so the file never becomes shorter
};

/// The part of a line that must equal the stored line when it is added again.
enum class Equal {
  kWhole,
  kButLastField,  ///< of a CSV table
  kNot,           ///< may differ, because the line depends on the machine
};

/// A file that grows line by line. Every line is in the file when add() returns, so a killed program loses none.
class LineFile {
 public:
  /// A last line without its newline is incomplete and is written again. @throws DiskError
  explicit LineFile(const std::filesystem::path& file, OldLines old = OldLines::kDrop);

  /// @param line without the newline. @throws DiskError; also if a stored line differs in the part that `equal`
  /// compares
  void add(std::string_view line, Equal equal = Equal::kWhole);

 private:
  [[nodiscard]] bool pass_over(std::string_view line, Equal equal);

  std::filesystem::path file_;
  std::optional<config::TextLines> kept_;
  std::size_t kept_bytes_ = 0;
  base::UniqueFd descriptor_;
};

}  // namespace twocone::runlog

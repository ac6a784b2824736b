// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json_fwd.hpp>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_data.h"

/// Writes and reads a run folder's tables as text (docs/file-formats.md). Numbers have enough digits to read back the
/// same double. A field that does not apply is empty.
namespace twocone::runlog {

// ---- fields of a CSV line (RFC 4180)

/// The types of fields that are numbers. bool is excluded.
template <typename T>
concept FieldNumber = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

/// Adds double quotes if the text contains a comma, a quote or a line break.
std::string to_field(const std::string& text);
template <FieldNumber Number>
std::string to_field(Number value) {
  return fmt::format("{}", value);
}
std::string to_field(const std::optional<double>& value);
/// Writes 1 or 0.
std::string to_field(const std::optional<bool>& value);
/// Separates names by semicolons. Inside a name, a backslash precedes each semicolon and backslash.
std::string to_field(const std::vector<std::string>& names);

/// Returns a row's line without its newline.
template <typename... Values>
std::string join_fields(const std::tuple<Values...>& row) {
  return std::apply(
      [](const auto& first, const auto&... rest) { return (to_field(first) + ... + (',' + to_field(rest))); }, row);
}

/// Returns the fields of a line without its newline, with quotes removed.
std::vector<std::string> split_fields(std::string_view line);

/// @returns whether the field is a valid value; `value` is set only then
bool parse_field(const std::string& field, std::string& value);
template <FieldNumber Number>
bool parse_field(const std::string& field, Number& value) {
  Number read{};
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), read);
  if (error != std::errc() || end != field.data() + field.size()) return false;
  value = read;
  return true;
}
bool parse_field(const std::string& field, std::optional<double>& value);
bool parse_field(const std::string& field, std::optional<bool>& value);
bool parse_field(const std::string& field, std::vector<std::string>& names);

// ---- tables

/// Reads a table row by row, for runs of any length. A last line without its newline is left out, because the program
/// ended while it wrote that line. A missing file counts as an empty table. Tables of older versions, which lack the
/// last columns of FixRow (outliers, or the columns after it) or the last one of TrackRow, are read too. Row: any row
/// of run_data.h except PoseRow.
template <typename Row>
class TableReader {
 public:
  /// Returns the first line of the table, without its newline.
  static std::string header();
  /// Returns the line of a row, without its newline.
  static std::string line(const Row& row);

  /// @throws config::FileError for a wrong header
  explicit TableReader(const std::filesystem::path& file);

  /// Returns nothing at the end. @throws config::FileError: FILE:LINE: the fault
  std::optional<Row> next();

 private:
  std::filesystem::path file_;
  std::optional<config::TextLines> lines_;
  std::size_t missing_ = 0;  ///< number of last columns that a table of an older version lacks
};

/// Returns all rows of a table. @throws config::FileError as TableReader
template <typename Row>
std::vector<Row> read_table(const std::filesystem::path& file) {
  std::vector<Row> rows;
  TableReader<Row> reader(file);
  while (auto row = reader.next()) rows.push_back(*std::move(row));
  return rows;
}
/// Reads a .tum file. @throws config::FileError: FILE:LINE: the fault
std::vector<PoseRow> read_poses(const std::filesystem::path& file);

template <typename Row>
std::string to_line(const Row& row) {
  return TableReader<Row>::line(row);
}
/// Returns the row as an object with the columns as keys. Fields that do not apply, and empty text, are left out.
template <typename Row>
nlohmann::ordered_json to_object(const Row& row);
/// Returns the names of the columns whose fields are texts or lists of names.
template <typename Row>
std::set<std::string> text_columns();
/// Returns the row's line. The heading is rounded to 1e-9 rad, as in the .tum files, because the heading of method
/// paper comes from such a file.
std::string to_line(const TrackRow& row);
/// Returns a line in TUM format: t tx ty tz qx qy qz qw. The heading is rounded to 1e-9 rad.
std::string to_line(const PoseRow& row);

}  // namespace twocone::runlog

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

/// Writes and reads the fields of a CSV line (RFC 4180). Numbers are written so that reading gives the same double. A
/// value that does not apply is an empty field.
namespace twocone::runlog {

/// Adds double quotes if the text contains a comma, a quote or a line break.
std::string to_field(const std::string& text);
std::string to_field(double value);
std::string to_field(int value);
std::string to_field(std::uint64_t value);
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
bool parse_field(const std::string& field, double& value);
bool parse_field(const std::string& field, int& value);
bool parse_field(const std::string& field, std::uint64_t& value);
bool parse_field(const std::string& field, std::optional<double>& value);
bool parse_field(const std::string& field, std::optional<bool>& value);
bool parse_field(const std::string& field, std::vector<std::string>& names);

}  // namespace twocone::runlog

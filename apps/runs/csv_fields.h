// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

/// The fields of a line of CSV (RFC 4180), both ways. Numbers are written so that reading gives the same double; what
/// does not apply is an empty field.
namespace twocone::runs {

/// In double quotes where it holds a comma, a quote or a line break.
std::string to_field(const std::string& text);
std::string to_field(double value);
std::string to_field(int value);
std::string to_field(std::uint64_t value);
std::string to_field(const std::optional<double>& value);
/// 1 or 0.
std::string to_field(const std::optional<bool>& value);
/// With a semicolon between names; in a name, a backslash stands before it and before a backslash.
std::string to_field(const std::vector<std::string>& names);

/// A row's line, without its newline.
template <typename... Values>
std::string join_fields(const std::tuple<Values...>& row) {
  return std::apply(
      [](const auto& first, const auto&... rest) { return (to_field(first) + ... + (',' + to_field(rest))); }, row);
}

/// What is between the commas of a line without its newline, quotes taken away.
std::vector<std::string> split_fields(std::string_view line);

/// @returns whether the field is such a value, which is set only then
bool parse_field(const std::string& field, std::string& value);
bool parse_field(const std::string& field, double& value);
bool parse_field(const std::string& field, int& value);
bool parse_field(const std::string& field, std::uint64_t& value);
bool parse_field(const std::string& field, std::optional<double>& value);
bool parse_field(const std::string& field, std::optional<bool>& value);
bool parse_field(const std::string& field, std::vector<std::string>& names);

}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/tables/csv_fields.h"

#include <charconv>
#include <utility>

#include <fmt/format.h>

namespace twocone::runlog {
namespace {

constexpr char kBetween = ';';

template <typename Number>
bool parse_number(const std::string& field, Number& value) {
  Number read{};
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), read);
  if (error != std::errc() || end != field.data() + field.size()) return false;
  value = read;
  return true;
}

}  // namespace

std::string to_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}
std::string to_field(double value) { return fmt::format("{}", value); }
std::string to_field(int value) { return fmt::format("{}", value); }
std::string to_field(std::uint64_t value) { return fmt::format("{}", value); }
std::string to_field(const std::optional<double>& value) { return value ? to_field(*value) : std::string(); }
std::string to_field(const std::optional<bool>& value) { return value ? to_field(int(*value)) : std::string(); }
std::string to_field(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += kBetween;
    for (const char c : names[i]) {
      if (c == kBetween || c == '\\') text += '\\';
      text += c;
    }
  }
  return to_field(text);
}

std::vector<std::string> split_fields(std::string_view line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += line[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

bool parse_field(const std::string& field, std::string& value) {
  value = field;
  return true;
}
bool parse_field(const std::string& field, double& value) { return parse_number(field, value); }
bool parse_field(const std::string& field, int& value) { return parse_number(field, value); }
bool parse_field(const std::string& field, std::uint64_t& value) { return parse_number(field, value); }
bool parse_field(const std::string& field, std::optional<double>& value) {
  double number = 0;
  if (!field.empty() && !parse_field(field, number)) return false;
  value = field.empty() ? std::nullopt : std::optional(number);
  return true;
}
bool parse_field(const std::string& field, std::optional<bool>& value) {
  if (!field.empty() && field != "0" && field != "1") return false;
  value = field.empty() ? std::nullopt : std::optional(field == "1");
  return true;
}
bool parse_field(const std::string& field, std::vector<std::string>& names) {
  std::vector<std::string> read;
  if (!field.empty()) read.emplace_back();
  for (std::size_t i = 0; i < field.size(); ++i) {
    if (field[i] == '\\') {
      if (++i == field.size()) return false;
      read.back() += field[i];
    } else if (field[i] == kBetween) {
      read.emplace_back();
    } else {
      read.back() += field[i];
    }
  }
  names = std::move(read);
  return true;
}

}  // namespace twocone::runlog

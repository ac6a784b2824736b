// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <yaml-cpp/node/node.h>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/yaml/text_file.h"
#include "apps/config/yaml/yaml_reader.h"
#include "tests/support/error_of.h"

namespace twocone::config {

inline std::filesystem::path data(const std::string& name) {
  return std::filesystem::path(TWOCONE_SOURCE_DIR) / "tests/config/data" / name;
}

inline std::string good_robot_text() { return read_text(data("good_robot.yaml")); }

/// The things that data/good_map.yaml lets move, written out.
inline std::vector<Moving> moving_in_good_map() {
  return {{.name = "cart_2",
           .path_m = {{0.2, -1.1}, {1.7, -1.3}, {1.1, 0.4}},
           .speed_mps = 0.23,
           .loop = true,
           .radius_m = 0.19},
          {.name = "cat", .path_m = {{-1.2, 2.1}, {-0.3, 2.2}}, .speed_mps = 0.6, .radius_m = 0.11}};
}

/// Reads the text as a file robot.yaml in the current folder.
inline Robot parsed_robot(const std::string& text) { return parse_robot(parse_yaml(text, "robot.yaml"), "robot.yaml"); }

/// Returns `text` with its only `find` replaced. A case that no longer fits its fixture must not pass by accident.
inline std::string with(const std::string& text, const std::string& find, const std::string& replace) {
  const std::size_t at = text.find(find);
  if (at == std::string::npos || text.find(find, at + 1) != std::string::npos) {
    throw std::logic_error(fmt::format("'{}' must stand once in the fixture", find));
  }
  return std::string(text).replace(at, find.size(), replace);
}

/// Returns the message of the FileError that `read` throws, or "no error".
std::string message_of(const auto& read) { return testing_support::error_of<FileError>(read); }

/// One change of a good file and the complete error message for it.
struct BadCase {
  const char* name;
  const char* find;
  const char* replace;
  const char* message;

  friend void PrintTo(const BadCase& bad, std::ostream* out) { *out << bad.name; }
};

template <typename Case>
std::string name_of(const testing::TestParamInfo<Case>& info) {
  return info.param.name;
}

}  // namespace twocone::config

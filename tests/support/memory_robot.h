// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace twocone::testing_support {

/// Writes the robot file of tests/end_to_end/data/small.yaml with parts of driver memory, so that nothing is rendered.
/// @param changes further texts of the file, each with its replacement
inline void write_memory_robot(const std::filesystem::path& file,
                               const std::vector<std::pair<std::string, std::string>>& changes = {}) {
  std::ifstream in(TWOCONE_SOURCE_DIR "/tests/end_to_end/data/small.yaml");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto replace = [&text](const std::string& what, const std::string& with) {
    for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at)) {
      text.replace(at, what.size(), with);
    }
  };
  replace("driver: sim_povray", "driver: memory");
  replace("../../../scenes", TWOCONE_SOURCE_DIR "/scenes");
  replace("effects: {slip: 0.01, encoder_counts_per_turn: 1024}", "");
  for (const auto& [what, with] : changes) replace(what, with);
  std::ofstream(file) << text;
}

}  // namespace twocone::testing_support

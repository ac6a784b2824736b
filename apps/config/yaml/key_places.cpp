// SPDX-License-Identifier: Apache-2.0
#include "apps/config/yaml/key_places.h"

#include <string>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/yaml/yaml_reader.h"

namespace twocone::config {
namespace {

void add_keys(const YAML::Node& node, const std::string& prefix, const std::string& file,
              sim_povray::KeyPlaces& places) {
  if (!node.IsMap()) return;
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) continue;  // the reader of the file rejects such a key
    const std::string key = prefix + pair.first.Scalar();
    places.emplace(key, fmt::format("{}:{}", file, pair.first.Mark().line + 1));
    add_keys(pair.second, key + ".", file, places);
  }
}

}  // namespace

sim_povray::KeyPlaces key_places(const Robot& robot, const Map& map) {
  sim_povray::KeyPlaces places;
  add_keys(load_yaml(robot.file), "", robot.file.string(), places);
  add_keys(load_yaml(map.file), "map.", map.file.string(), places);
  return places;
}

}  // namespace twocone::config

// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/keys/robot_keys.h"
#include "apps/config/map_file.h"
#include "apps/config/yaml/text_file.h"
#include "apps/config/yaml/yaml_reader.h"

namespace twocone::config {
namespace {

YAML::Node node_of(const LandmarkSigma& sigma) {
  if (sigma == LandmarkSigma{}) return YAML::Node(0);
  return list_of(std::array{sigma.x_m, sigma.y_m, sigma.top_m, sigma.radius_m});
}

YAML::Node node_of(const Landmark& landmark) {
  YAML::Node node;
  node.SetStyle(YAML::EmitterStyle::Flow);
  node["name"] = landmark.name;
  if (landmark.bands) {
    node["bands"] = landmark.bands->number;
    if (landmark.bands->cell_m != Bands{}.cell_m) node["cell_m"] = text_of(landmark.bands->cell_m);
  } else {
    node["colour"] = list_of(landmark.colour);
  }
  node["x_m"] = text_of(landmark.x_m);
  node["y_m"] = text_of(landmark.y_m);
  node["radius_m"] = text_of(landmark.radius_m);
  node[landmark.bands ? "line_m" : "top_m"] = text_of(landmark.top_m);
  node["sigma_m"] = node_of(landmark.sigma);
  return node;
}

}  // namespace

std::string map_text(const std::filesystem::path& original, const std::filesystem::path& new_file, const Map& changed,
                     const std::vector<std::string>& header_lines) {
  YAML::Node node = load_map_node(original);
  if (changed.scene) node["scene"] = changed.scene->string();
  node.remove("landmark_sigma_m");
  node.remove("survey");
  if (!changed.survey.empty()) node["survey"] = relative_to(new_file, std::filesystem::absolute(changed.survey));
  node["landmarks"] = YAML::Node(YAML::NodeType::Sequence);
  for (const Landmark& landmark : changed.landmarks) node["landmarks"].push_back(node_of(landmark));
  std::string text = "# SPDX-License-Identifier: Apache-2.0\n" + comments(header_lines);
  text += comments({fmt::format("From {}, whose comments are not kept.", original.filename().string())});
  YAML::Emitter emitter;
  emitter << node;
  text += fmt::format("{}\n", emitter.c_str());
  (void)parse_map(parse_yaml(text, new_file), new_file);  // never return text that read_map rejects
  return text;
}

}  // namespace twocone::config

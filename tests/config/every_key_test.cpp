// SPDX-License-Identifier: Apache-2.0
// Leaves out every key of the shipped lab files, and gives it impossible values in turn. The accepted cases are listed
// here with a reason. All others must be rejected by a single line that names exactly this key and its line.
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "tests/config/fixtures.h"

namespace twocone::config {
namespace {

/// A step from a file's root to a value: a key or a list index.
struct Step {
  std::string key;
  std::size_t index = 0;
};
using Path = std::vector<Step>;

std::string to_string(const Path& path) {
  std::string text;
  for (const Step& step : path) {
    if (step.key.empty()) {
      text += fmt::format("[{}]", step.index);
    } else {
      text += fmt::format("{}{}", text.empty() ? "" : ".", step.key);
    }
  }
  return text;
}

/// Collects the paths of all keys, each before those below it. Lists of numbers count as values; lists of mappings are
/// walked.
void walk(const YAML::Node& node, const Path& here, std::vector<Path>& paths) {
  if (node.IsMap()) {
    for (const auto& pair : node) {
      Path path = here;
      path.push_back({pair.first.Scalar()});
      paths.push_back(path);
      walk(pair.second, path, paths);
    }
  } else if (node.IsSequence()) {
    for (std::size_t i = 0; i < node.size(); ++i) {
      if (!node[i].IsMap()) continue;
      Path path = here;
      path.push_back({"", i});
      walk(node[i], path, paths);
    }
  }
}

YAML::Node parent_of(const YAML::Node& root, const Path& path) {
  YAML::Node node = root;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    node.reset(path[i].key.empty() ? node[path[i].index] : node[path[i].key]);
  }
  return node;
}

enum class Change { kLeftOut, kWord, kMinusOne };

/// Removes list indices, for the tables of accepted cases: landmarks.x_m.
std::string without_indices(const std::string& path) {
  std::string text;
  bool inside = false;
  for (const char c : path) {
    if (c == '[') inside = true;
    if (!inside) text += c;
    if (c == ']') inside = false;
  }
  return text;
}

using Accepted = std::map<Change, std::set<std::string>>;

void change_every_key(const std::string& name, const Accepted& accepted,
                      const std::function<void(const YAML::Node&, const std::filesystem::path&)>& parse) {
  const std::string text = read_text(std::filesystem::path(TWOCONE_SOURCE_DIR) / name);
  std::vector<Path> paths;
  walk(YAML::Load(text), {}, paths);
  ASSERT_GT(paths.size(), 10u);
  Accepted unused = accepted;
  for (const Path& path : paths) {
    for (const Change change : {Change::kLeftOut, Change::kWord, Change::kMinusOne}) {
      YAML::Node root = YAML::Load(text);  // loaded again, because copies share values and clones lose lines
      YAML::Node parent = parent_of(root, path);
      const std::string& key = path.back().key;
      int line = 0;
      for (const auto& pair : parent) {
        if (pair.first.Scalar() == key) line = pair.first.Mark().line + 1;
      }
      if (change == Change::kLeftOut) {
        ASSERT_TRUE(parent.remove(key));
      } else {
        parent[key] = change == Change::kWord ? YAML::Load("abc") : YAML::Load("-1");
      }
      const std::string named = to_string(path);
      const std::string message = message_of([&] { parse(root, name); });
      const char* const done = change == Change::kLeftOut ? "left out" : change == Change::kWord ? "abc" : "-1";
      const std::string general = without_indices(named);
      if (accepted.contains(change) && accepted.at(change).contains(general)) {
        EXPECT_EQ(message, "no error") << named << " " << done;
        unused[change].erase(general);
        continue;
      }
      EXPECT_EQ(message.find('\n'), std::string::npos) << named << " " << done << ":\n" << message;
      if (change == Change::kLeftOut) {
        EXPECT_EQ(message.rfind(name + ":", 0), 0u) << message;
        const bool is_shape = general == "obstacles.polygon_m" || general == "obstacles.circle_m";
        const std::string says = is_shape ? fmt::format(": {} has neither", named.substr(0, named.rfind('.')))
                                          : fmt::format(": {} is missing: ", named);
        EXPECT_NE(message.find(says), std::string::npos) << named << " " << done << ":\n" << message;
      } else {
        EXPECT_EQ(message.rfind(fmt::format("{}:{}: {} is ", name, line, named), 0), 0u)
            << named << " " << done << ":\n"
            << message;
      }
    }
  }
  for (const auto& [change, keys] : unused) {
    EXPECT_TRUE(keys.empty()) << "listed as accepted, but not in the file: " << *keys.begin();
  }
}

TEST(EveryKey, OfTheLabRobot) {
  const std::set<std::string> text = {"name", "map", "drive.driver", "cameras.lower.driver", "cameras.upper.driver"};
  std::set<std::string> may_be_negative = text;  // -1 is text too
  may_be_negative.insert(
      {"start.x_m", "start.y_m", "start.heading_rad", "rig.lower.azimuth_rad", "rig.upper.azimuth_rad"});
  change_every_key("robots/lab_sim.yaml",
                   {{Change::kLeftOut,
                     {"start",                     // a real robot has none; to_robot_settings requires it where needed
                      "latency_frames",            // documented default 4
                      "drive.sigma", "rig.sigma",  // those of a ruler
                      "rig.lower", "rig.upper",    // left to the images, with their keys
                      "rig.lower.centre_px", "rig.lower.rim_radius_px", "rig.lower.azimuth_rad", "rig.upper.centre_px",
                      "rig.upper.rim_radius_px", "rig.upper.azimuth_rad",
                      "drive.command_timeout_s",                                     // documented default 0.5 s
                      "effects", "effects.slip", "effects.encoder_counts_per_turn",  // none: ideal
                      "waypoints_m"}},                                               // only for that behaviour
                    {Change::kWord, text},
                    {Change::kMinusOne, may_be_negative}},
                   [](const YAML::Node& node, const std::filesystem::path& file) { parse_robot(node, file); });
}

TEST(EveryKey, OfTheLabMap) {
  change_every_key("scenes/lab.map.yaml",
                   {{Change::kLeftOut,
                     {"scene",                                     // a real room has none
                      "landmark_sigma_m",                          // that of a tape measure
                      "obstacles", "effects"}},                    // none
                    {Change::kWord, {"scene", "landmarks.name"}},  // text
                    {Change::kMinusOne,
                     {"scene", "landmarks.name",         // text
                      "landmarks.x_m", "landmarks.y_m",  // inside the lab
                      "obstacles.circle_m.x", "obstacles.circle_m.y"}}},
                   [](const YAML::Node& node, const std::filesystem::path& file) { parse_map(node, file); });
}

}  // namespace
}  // namespace twocone::config

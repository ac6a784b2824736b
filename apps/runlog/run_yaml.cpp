// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/run_data.h"

#include <regex>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/yaml/names.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/disk.h"
#include "base/hash.h"

namespace twocone::runlog {
namespace {

namespace fs = std::filesystem;

fs::path file_of(const fs::path& folder) { return folder / "run.yaml"; }

template <typename T>
T field(const YAML::Node& node, const char* key, const fs::path& file) {
  if (!node[key])
    throw config::FileError("{}: key {} is missing: was this written by twocone run?", file.string(), key);
  try {
    return node[key].as<T>();
  } catch (const YAML::Exception&) {
    throw config::FileError("{}:{}: {} cannot be read", file.string(), node[key].Mark().line + 1, key);
  }
}

constexpr const char* kComment = "A run of twocone: what it was made from. Tables and images lie beside this file.";

std::string absolute_text(const fs::path& file) { return fs::absolute(file).lexically_normal().string(); }

YAML::Node load(const fs::path& file) {
  try {
    return YAML::Load(config::read_text(file));
  } catch (const YAML::Exception& error) {
    throw config::FileError("{}:{}: {}", file.string(), error.mark.line + 1, error.msg);
  }
}

/// Returns the changes of the robot file's keys. Runs without changes lack this key.
std::vector<config::KeyChange> robot_changes(const YAML::Node& node, const fs::path& file) {
  std::vector<config::KeyChange> changes;
  if (!node["robot_changes"]) return changes;
  for (const std::string& text : field<std::vector<std::string>>(node, "robot_changes", file)) {
    changes.push_back(config::parse_change(text));
  }
  return changes;
}

void set_map(YAML::Node& node, const fs::path& map_file) {
  node["map_file"] = absolute_text(map_file);
  node["map"] = config::load_map_node(map_file);
}

void write_again(const fs::path& folder, const YAML::Node& node) {
  YAML::Emitter out;
  out << YAML::Comment(kComment) << node;
  write_whole(file_of(folder), std::string(out.c_str()) + '\n');
}

/// Returns the first difference between two nodes, below `path`, or an empty text.
std::string difference(const std::string& path, const YAML::Node& then, const YAML::Node& now) {
  const auto below = [&path](const std::string& key) { return path.empty() ? key : path + "." + key; };
  const auto text = [](const YAML::Node& node) {
    YAML::Emitter out;
    out << YAML::Flow << node;
    return std::string(out.c_str());
  };
  if (then.Type() != now.Type() || !(then.IsMap() || then.IsSequence())) {
    const std::string before = text(then), after = text(now);
    // Paths are kept as they were written, so robots/../scenes/lab.pov equals scenes/lab.pov.
    const auto normal = [](const std::string& value) { return fs::path(value).lexically_normal(); };
    return normal(before) == normal(after) ? "" : fmt::format("{} was {}, and is {}", path, before, after);
  }
  if (then.IsSequence()) {
    if (then.size() != now.size()) return fmt::format("{} had {} entries, and has {}", path, then.size(), now.size());
    for (std::size_t i = 0; i < then.size(); ++i) {
      if (std::string found = difference(fmt::format("{}[{}]", path, i), then[i], now[i]); !found.empty()) return found;
    }
    return {};
  }
  for (const auto& entry : then) {
    const auto key = entry.first.as<std::string>();
    if (!now[key]) return fmt::format("{} was {}, and is not there any more", below(key), text(entry.second));
    if (std::string found = difference(below(key), entry.second, now[key]); !found.empty()) return found;
  }
  for (const auto& entry : now) {
    const auto key = entry.first.as<std::string>();
    if (!then[key]) return fmt::format("{} was not there, and is {}", below(key), text(entry.second));
  }
  return {};
}

std::string digest_of(std::string_view bytes) { return fmt::format("{:016x}", base::fnv1a(bytes)); }

/// Returns the texts between quotation marks that may be names of files. Texts in comments are included, but do no
/// harm. A single quotation mark, for example in a comment, does not hide the names after it.
std::vector<std::string> quoted_in(const std::string& text) {
  static const std::regex kQuoted("\"([^\"\n]{1,255})\"");
  std::vector<std::string> names;
  for (std::sregex_iterator match(text.begin(), text.end(), kQuoted), end; match != end; ++match) {
    names.push_back((*match)[1]);
  }
  return names;
}

/// Adds a file, and those that it names in one of the folders.
void add(const fs::path& path, const std::vector<fs::path>& folders, FileDigests& digests) {
  const fs::path file = fs::absolute(path).lexically_normal();
  std::error_code none;
  if (!fs::is_regular_file(file, none) || digests.contains(file.string())) return;
  std::string text;
  try {
    text = config::read_text(file);
  } catch (const config::FileError&) {
    return;
  }
  digests[file.string()] = digest_of(text);
  if (file.extension() != ".pov" && file.extension() != ".inc") return;
  for (const std::string& name : quoted_in(text)) {
    for (const fs::path& folder : folders) add(folder / name, folders, digests);
  }
}

}  // namespace

void write_run_yaml(const fs::path& folder, const RunInfo& info, const config::Robot& robot, const fs::path& map_file) {
  YAML::Emitter out;
  out.SetDoublePrecision(17);
  out << YAML::Comment(kComment);
  out << YAML::BeginMap;
  const auto put = [&out](const char* key, const auto& value) { out << YAML::Key << key << YAML::Value << value; };
  for (const auto& [key, member] : kProgramKeys) put(key, info.*member);
  put("behaviour", info.behaviour);
  put("method", info.method);
  put("seed", info.seed);
  put("frames_wanted", info.frames_wanted);
  if (info.truth) put("truth", true);
  if (info.real_time) put("real_time", true);
  if (info.maps) put("landmarks", "none");
  if (info.telemetry) put("telemetry", true);
  if (!info.renderer.empty()) put("renderer", info.renderer);
  if (!info.scene_files.empty()) {
    out << YAML::Key << "scene_files" << YAML::Value << YAML::BeginMap;
    for (const auto& [file, digest] : info.scene_files) {
      out << YAML::Key << file << YAML::Value << YAML::DoubleQuoted << digest;
    }
    out << YAML::EndMap;
  }
  put("effects", info.effects);
  if (!info.import_options.empty()) put("import_options", info.import_options);
  if (!info.devices.empty()) put("devices", info.devices);
  if (info.capture) {
    out << YAML::Key << "capture" << YAML::Value << YAML::BeginMap;
    for (const auto& [key, member] : kCaptureCounts) put(key, (*info.capture).*member);
    out << YAML::EndMap;
  }
  put("finished", info.finished);
  for (const auto& [key, member] : kTimeKeys) put(key, info.*member);
  put("events", info.events);
  put("robot_file", absolute_text(robot.file));
  if (!robot.changes.empty()) {
    std::vector<std::string> changes;
    for (const config::KeyChange& change : robot.changes) changes.push_back(config::to_string(change));
    put("robot_changes", changes);
  }
  put("robot", config::load_robot_node(robot));
  put("map_file", absolute_text(map_file));
  put("map", config::load_map_node(map_file));
  out << YAML::EndMap;
  write_whole(file_of(folder), std::string(out.c_str()) + '\n');
}

void write_run_yaml_for(const OtherBeliefs& other, const fs::path& from, const fs::path& to) {
  YAML::Node node = load(file_of(from));  // all scalars keep their text
  std::string event = fmt::format("recorded in {}", absolute_text(from));
  if (!other.robot_file.empty()) {
    node["robot_file"] = absolute_text(other.robot_file);
    node["robot"] = config::load_robot_node(config::read_robot(other.robot_file));
    node.remove("robot_changes");
    event += fmt::format(", evaluated with the rig and the wheels of {}", absolute_text(other.robot_file));
  }
  const std::string map_file = absolute_text(other.map_file);
  set_map(node, other.map_file);
  event += fmt::format("{} with the map {}", other.robot_file.empty() ? ", evaluated" : " and", map_file);
  if (node["robot"]["map"].as<std::string>("") != map_file) {
    node["robot"]["map"] = map_file;
    node["robot_changes"].push_back(config::to_string(config::KeyChange{"map", map_file}));
  }
  node["events"].push_back(event);
  write_again(to, node);
}

void write_run_yaml_for_map(const fs::path& from, const fs::path& map_file, const std::string& event,
                            const fs::path& to) {
  YAML::Node node = load(file_of(from));
  set_map(node, map_file);
  node["events"].push_back(event);
  write_again(to, node);
}

std::string changed_since(const fs::path& folder) {
  const auto file = file_of(folder);
  const YAML::Node node = load(file);
  config::Robot robot = config::read_robot(field<std::string>(node, "robot_file", file), robot_changes(node, file));
  robot.estimator = config::parse_robot(node["robot"], file).estimator;  // may be from the command line
  if (std::string found = difference("", node["robot"], config::load_robot_node(robot)); !found.empty()) {
    return fmt::format("{}: {}", robot.file.string(), found);
  }
  const auto map_file = field<std::string>(node, "map_file", file);
  const std::string found = difference("", node["map"], config::load_map_node(map_file));
  return found.empty() ? "" : fmt::format("{}: {}", map_file, found);
}

RunYaml read_run_yaml(const fs::path& folder) {
  const auto file = file_of(folder);
  if (!fs::exists(file)) throw config::FileError("{}: no run here: there is no run.yaml", folder.string());
  const YAML::Node node = load(file);
  RunYaml run;
  for (const auto& [key, member] : kProgramKeys) run.info.*member = field<std::string>(node, key, file);
  run.info.behaviour = field<std::string>(node, "behaviour", file);
  run.info.method = config::present_name(config::NameOf::kMethod, field<std::string>(node, "method", file));
  run.info.seed = field<std::uint64_t>(node, "seed", file);
  run.info.frames_wanted = field<int>(node, "frames_wanted", file);
  if (node["renderer"]) run.info.renderer = field<std::string>(node, "renderer", file);
  if (node["truth"]) run.info.truth = field<bool>(node, "truth", file);
  run.info.maps = bool(node["landmarks"]);
  if (node["telemetry"]) run.info.telemetry = field<bool>(node, "telemetry", file);
  if (node["real_time"]) run.info.real_time = field<bool>(node, "real_time", file);
  // Runs on hardware and runs of older versions lack this key.
  if (node["scene_files"]) {
    for (const auto& entry : node["scene_files"]) {
      run.info.scene_files[entry.first.as<std::string>()] = entry.second.as<std::string>("");
    }
  }
  // Runs of versions without effects lack this key.
  if (node["effects"]) run.info.effects = field<std::vector<std::string>>(node, "effects", file);
  if (node["import_options"]) {
    run.info.import_options = field<std::vector<std::string>>(node, "import_options", file);
  }
  // Simulated runs have neither of these keys.
  if (node["devices"]) run.info.devices = field<std::vector<std::string>>(node, "devices", file);
  if (node["capture"]) {
    CaptureCounts& counts = run.info.capture.emplace();
    for (const auto& [key, member] : kCaptureCounts) {
      counts.*member = field<std::uint64_t>(node["capture"], key, file);
    }
  }
  run.info.finished = field<bool>(node, "finished", file);
  for (const auto& [key, member] : kTimeKeys) run.info.*member = field<double>(node, key, file);
  run.info.events = field<std::vector<std::string>>(node, "events", file);
  run.robot = config::parse_robot(node["robot"], file);
  run.robot.file = field<std::string>(node, "robot_file", file);
  run.robot.changes = robot_changes(node, file);
  run.map = config::parse_map(node["map"], file);
  run.map.file = field<std::string>(node, "map_file", file);
  return run;
}

FileDigests scene_files(const config::Map& map) {
  std::vector<fs::path> folders = map.scene_paths;
  folders.push_back(fs::absolute(*map.scene).lexically_normal().parent_path());
  FileDigests digests;
  add(*map.scene, folders, digests);
  return digests;
}

}  // namespace twocone::runlog

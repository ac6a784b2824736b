// SPDX-License-Identifier: Apache-2.0
#include "apps/config/keys/robot_keys.h"

#include <algorithm>
#include <string_view>

namespace twocone::config {
namespace {

constexpr std::string_view kMethods[] = {"paper", "outline"};
constexpr std::string_view kStages[] = {"found", "coarse", "fine", "adaptive"};
/// A position from ranges alone needs three landmarks.
constexpr std::size_t kFewestLandmarks = 3;

bool is_among(std::span<const std::string_view> words, const std::string& word) {
  return std::ranges::find(words, word) != words.end();
}

void read_landmarks(Section& section, std::vector<std::string>& landmarks) {
  constexpr std::string_view kKey = "landmarks";
  if (!section.texts(kKey, "names of the landmarks that are looked for", landmarks, Need::kOptional)) return;
  if (!section.has(kKey)) return;
  if (landmarks.size() < kFewestLandmarks) {
    section.complain(kKey, kNoUnit, fmt::format("a list of {} names or more", kFewestLandmarks));
  }
  for (auto name = landmarks.begin(); name != landmarks.end(); ++name) {
    if (std::find(landmarks.begin(), name, *name) == name) continue;
    section.complain(kKey, kNoUnit, fmt::format("a list without repetition: '{}' is in it twice", *name));
  }
}

}  // namespace

void read_estimator(Section& root, EstimatorKeys& keys) {
  Section* section = root.section("estimator", "how much work goes into a frame's answer", Need::kOptional);
  if (section == nullptr) return;
  if (section->text("method", "how to range and localise", keys.method, Need::kOptional) && section->has("method") &&
      !is_among(kMethods, keys.method)) {
    section->complain("method", kNoUnit, "paper or outline");
  }
  bool good_stage = section->text("stage", "how far outlines are fitted", keys.stage, Need::kOptional);
  if (good_stage && !is_among(kStages, keys.stage)) {
    section->complain("stage", kNoUnit, "found, coarse, fine or adaptive");
    good_stage = false;
  }
  read_landmarks(*section, keys.landmarks);
  section->flag("bearings", "whether fixes use bearings too", keys.bearings, Need::kOptional);
  section->number("enough_m", {"position sigma from which on nothing is refined", kMetres, kAboveZero}, keys.enough_m,
                  Need::kOptional);
  section->number("budget_s", {"time for a frame's answer", kSeconds, kAboveZero}, keys.budget_s);
  section->flag("plan", "whether the map's walls and obstacles place the robot too", keys.plan, Need::kOptional);

  const auto refuse = [&](std::string_view key, Unit unit, std::string_view where) {
    if (section->has(key)) section->complain(key, unit, fmt::format("absent {}", where));
  };
  if (keys.method == "paper") {
    for (const std::string_view key : {"stage", "bearings", "plan"}) refuse(key, kNoUnit, "with method: paper");
  }
  if (good_stage && keys.stage != "adaptive") {
    refuse("enough_m", kMetres, "without stage: adaptive");
    refuse("budget_s", kSeconds, "without stage: adaptive");
  }
}

void set_estimator(YAML::Node& robot, const EstimatorKeys& keys) {
  const EstimatorKeys defaults;
  YAML::Node node(YAML::NodeType::Map);
  if (keys.method != defaults.method) node["method"] = keys.method;
  if (keys.stage != defaults.stage) node["stage"] = keys.stage;
  if (keys.landmarks != defaults.landmarks) {
    node["landmarks"] = keys.landmarks;
    node["landmarks"].SetStyle(YAML::EmitterStyle::Flow);
  }
  if (keys.bearings != defaults.bearings) node["bearings"] = keys.bearings;
  if (keys.enough_m != defaults.enough_m) node["enough_m"] = text_of(keys.enough_m);
  if (keys.budget_s) node["budget_s"] = text_of(*keys.budget_s);
  if (keys.plan != defaults.plan) node["plan"] = keys.plan;
  robot.remove("estimator");
  if (node.size() > 0) robot["estimator"] = node;
}

}  // namespace twocone::config

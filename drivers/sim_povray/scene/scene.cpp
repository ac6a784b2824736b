// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene/scene.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace twocone::sim_povray {
namespace {

/// Keywords of the blocks of POV-Ray 3.7 that are objects of a scene and take a transformation.
const std::set<std::string_view> kObjects{
    "bicubic_patch", "blob",         "box",          "cone",           "cubic",         "cylinder", "difference",
    "disc",          "height_field", "intersection", "isosurface",     "julia_fractal", "lathe",    "light_group",
    "light_source",  "merge",        "mesh",         "mesh2",          "object",        "ovus",     "parametric",
    "plane",         "poly",         "polygon",      "prism",          "quadric",       "quartic",  "smooth_triangle",
    "sor",           "sphere",       "sphere_sweep", "superellipsoid", "text",          "torus",    "triangle",
    "union"};

}  // namespace

SceneOutline outline(std::string_view text) {
  TokenTree tree = take_apart(text);
  if (tree.fault) throw SceneError(*std::move(tree.fault));
  return std::move(tree.outline);
}

Scene::Scene(std::string path, std::string text, SceneOutline found)
    : path_(std::move(path)), text_(std::move(text)), found_(std::move(found)), prefix_("Twocone_") {
  while (text_.find(prefix_) != std::string::npos) prefix_ += '_';
}

Result<Scene> Scene::read(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    return Error(ErrorCode::kNotFound, "{}: no such scene file", path.string());
  }
  if (!std::filesystem::is_regular_file(status)) {
    return Error(ErrorCode::kRefused, "{}: is not a file", path.string());
  }
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) return Error(ErrorCode::kRefused, "{}: cannot be read", path.string());
  return parse(std::move(text), path.string());
}

Result<Scene> Scene::parse(std::string text, std::string path) {
  try {
    SceneOutline found = outline(text);
    return Scene(std::move(path), std::move(text), std::move(found));
  } catch (const SceneError& e) {
    return Error(ErrorCode::kRefused, "{}:{}:{}: {}", path, e.place.line, e.place.column, e.message);
  }
}

Error Scene::refused(const Place& place, const std::string& message) const {
  return Error(ErrorCode::kRefused, "{}:{}:{}: {}", path_, place.line, place.column, message);
}

Error Scene::refused(const NamedBlock& block, const char* wanted) const {
  return refused(block.place, fmt::format("'{}' must be {}, but is {}", block.name, wanted,
                                          block.keyword.empty() ? "a brace without a keyword"
                                                                : fmt::format("a '{}'", block.keyword)));
}

bool Scene::mentions(const std::string& name) const {
  return std::ranges::find(found_.blocks, name, &NamedBlock::name) != found_.blocks.end() ||
         std::ranges::find(found_.strays, name, &SceneOutline::Stray::name) != found_.strays.end();
}

std::vector<std::string> Scene::names() const {
  std::vector<std::string> result;
  for (const NamedBlock& block : found_.blocks) {
    if (std::find(result.begin(), result.end(), block.name) == result.end()) result.push_back(block.name);
  }
  return result;
}

Result<NamedBlock> Scene::robot(const std::string& name) const {
  const std::string own = "robot." + name;
  if (!name.empty() && mentions(own)) return object(own);
  if (!mentions("robot")) {
    std::vector<std::string> others = names();
    std::erase_if(others, [](const std::string& other) { return !other.starts_with("robot."); });
    if (!others.empty()) {
      return Error(ErrorCode::kRefused, "{}: no object '{}' for the robot '{}'; the scene's robots are: {}", path_, own,
                   name, fmt::join(others, ", "));
    }
  }
  return object("robot");
}

Result<NamedBlock> Scene::object(const std::string& name) const {
  auto found = find(name, "union", "object");
  if (found && !kObjects.contains(found->keyword)) return refused(*found, "an object (union, merge, object, ...)");
  return found;
}

Result<NamedBlock> Scene::camera(const std::string& name) const {
  auto found = find(name, "camera", "camera");
  if (found && found->keyword != "camera") return refused(*found, "a camera");
  return found;
}

Result<NamedBlock> Scene::camera_of(const NamedBlock& robot, const std::string& name) const {
  return camera(name + robot.name.substr(std::string_view("robot").size()));
}

Result<NamedBlock> Scene::find(const std::string& name, const std::string& keyword, const std::string& what) const {
  std::vector<NamedBlock> named;
  std::ranges::copy_if(found_.blocks, std::back_inserter(named), [&](const NamedBlock& b) { return b.name == name; });
  if (named.size() > 1) {
    std::string lines;
    for (const auto& block : named) lines += fmt::format("{}{}", lines.empty() ? "" : ", ", block.place.line);
    return refused(named[1].place, fmt::format("'{}' is the name of {} blocks, in lines {}; which one is the {}?", name,
                                               named.size(), lines, what));
  }
  if (named.size() == 1) {
    if (named[0].obstacle.empty()) return named[0];
    return refused(named[0].place, fmt::format("the {} '{}' must stand at the top level of the file, and {}", what,
                                               name, named[0].obstacle));
  }
  const auto stray = std::ranges::find(found_.strays, name, &SceneOutline::Stray::name);
  if (stray != found_.strays.end()) {
    return refused(stray->place, fmt::format("'//*PMName {}' names nothing here: it must be the first line inside the "
                                             "braces of the {}",
                                             name, what));
  }
  // All names are listed, so that a misspelt one is noticed.
  const std::vector<std::string> others = names();
  return Error(ErrorCode::kRefused,
               "{}: no {} '{}': looked for '{} {{' with the comment '//*PMName {}' as the first line inside its "
               "braces, at the top level of this file (not in files that it includes){}",
               path_, what, name, keyword, name,
               others.empty() ? "; nothing in this file has a name"
                              : fmt::format("; names in this file: {}", fmt::join(others, ", ")));
}

std::string Scene::with(std::vector<Insertion> insertions) const {
  std::ranges::stable_sort(insertions, {}, &Insertion::offset);
  std::string result;
  std::size_t done = 0;
  for (const auto& insertion : insertions) {
    result.append(text_, done, insertion.offset - done).append(insertion.text);
    done = insertion.offset;
  }
  result.append(text_, done);
  // POV-Ray accepts a byte-order mark in the first image of an animation only.
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (result.starts_with(kMark)) result.replace(0, kMark.size(), kMark.size(), ' ');
  return result;
}

ViewTemplate Scene::view_template(const std::vector<NamedBlock>& moved, const NamedBlock& view,
                                  const std::string& mask) const {
  // The camera is declared here, and used at the very end, because POV-Ray uses the last camera of a scene.
  std::vector<Insertion> insertions;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    insertions.push_back({moved[i].close, fmt::format(" transform {{ {}X{} }} ", prefix_, i)});
  }
  // The mask is inserted where the camera is: an identifier of its statement may have another value farther down.
  if (!mask.empty())
    insertions.push_back({view.begin, fmt::format("object {{ {} transform {{ {}V }} }} ", mask, prefix_)});
  insertions.push_back({view.begin, fmt::format("#declare {}View = ", prefix_)});
  insertions.push_back({view.close, fmt::format(" transform {{ {}V }} ", prefix_)});
  ViewTemplate view_template{.pose_offset = std::ranges::min(insertions, {}, &Insertion::offset).offset};
  view_template.pose_prefix = prefix_;
  view_template.scene = with(std::move(insertions)) + fmt::format("\ncamera {{ {}View }}\n", prefix_);
  return view_template;
}

std::string Scene::pose_text(const std::vector<FloorMotion>& motions, const FloorMotion& view_motion,
                             double unit_m) const {
  std::string text;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    text += fmt::format("#declare {}X{} = transform {{ {} }} ", prefix_, i, matrix(motions[i], unit_m));
  }
  return text + fmt::format("#declare {}V = transform {{ {} }}", prefix_, matrix(view_motion, unit_m));
}

std::string matrix(const FloorMotion& motion, double unit_m) {
  // POV-Ray multiplies row vectors: each row is the image of one axis. World x, y, z are its x, z, y.
  // 0 - s instead of -s: no "-0".
  return fmt::format("matrix <{},0,{}, 0,1,0, {},0,{}, {},0,{}>", motion.cos_turn, motion.sin_turn, 0 - motion.sin_turn,
                     motion.cos_turn, motion.x_m / unit_m, motion.y_m / unit_m);
}

}  // namespace twocone::sim_povray

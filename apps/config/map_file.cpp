// SPDX-License-Identifier: Apache-2.0
#include "apps/config/map_file.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/yaml/text_file.h"
#include "apps/config/yaml/yaml_reader.h"
#include "vision/bands/band_code.h"

namespace twocone::config {
namespace {

constexpr Quantity kColour{"colour, linear rgb", kNoUnit, {.least = 0, .greatest = 1}};

/// Returns the bounds if both sides are valid.
std::optional<Bounds> read_bounds(Section& map) {
  Section* section = map.section("bounds_m", "the walls, {x: [least, greatest], y: [least, greatest]}");
  if (section == nullptr) return std::nullopt;
  const auto read_side = [&](std::string_view key, std::string_view what, double& least, double& greatest) {
    std::array<double, 2> side{};
    if (!section->numbers(key, {what, kMetres, kAnyNumber}, side)) return false;
    if (!(side[0] < side[1])) return section->complain(key, kMetres, "[least, greatest], least < greatest"), false;
    least = side[0];
    greatest = side[1];
    return true;
  };
  Bounds bounds;
  bool good = read_side("x", "least and greatest x of the floor", bounds.min_x_m, bounds.max_x_m);
  good &= read_side("y", "least and greatest y of the floor", bounds.min_y_m, bounds.max_y_m);
  return good ? std::optional(bounds) : std::nullopt;
}

/// Reads a number, which is that of all four, or [x, y, top, radius].
std::optional<LandmarkSigma> read_sigma(Section& section, std::string_view key) {
  if (!section.has(key)) return std::nullopt;
  std::array<double, 4> s{};
  const Quantity quantity{"standard deviations of [x, y, top, radius], or one number for all", kMetres, kZeroOrMore};
  if (!section.number_or_list(key, quantity, s)) return std::nullopt;
  return LandmarkSigma{s[0], s[1], s[2], s[3]};
}

void read_bands(Section& section, Landmark& landmark) {
  Bands bands;
  const Range numbers{.least = 1, .greatest = vision::kBandNumbers};
  section.whole("bands", {"the number of its bands (twocone print-bands)", kNoUnit, numbers}, bands.number);
  section.number("cell_m", {"height of a cell of its bands", kMetres, kAboveZero}, bands.cell_m, Need::kOptional);
  section.number("line_m", {"height above the floor of the line that the print marks", kMetres, kAboveZero},
                 landmark.top_m);
  if (section.has("colour")) section.complain("colour", kNoUnit, "absent: its bands identify it");
  if (section.has("top_m")) section.complain("top_m", kMetres, "absent: line_m is the height that is measured");
  landmark.bands = bands;
}

Landmark read_landmark(Section& section, const std::optional<Bounds>& bounds) {
  Landmark landmark;
  section.text("name", "the landmark's name", landmark.name);
  if (section.has("bands")) {
    read_bands(section, landmark);
  } else {
    if (section.numbers("colour", kColour, landmark.colour)) {
      const auto [least, greatest] = std::ranges::minmax_element(landmark.colour);
      if (*least == *greatest) {
        section.complain("colour", kNoUnit, "a colour with a hue, not grey: the hue identifies it, or bands: NUMBER");
      }
    }
    section.number("top_m", {"height of its top above the floor", kMetres, kAboveZero}, landmark.top_m);
  }
  const auto read_place = [&](std::string_view key, std::string_view what, double& value, double least, double greatest,
                              std::string_view side) {
    if (!section.number(key, {what, kMetres, kAnyNumber}, value) || !bounds) return;
    if (value < least || value > greatest) {
      section.complain(key, kMetres, fmt::format("within bounds_m.{}, {} to {}", side, least, greatest));
    }
  };
  const Bounds within = bounds.value_or(Bounds{});
  read_place("x_m", "x of its axis", landmark.x_m, within.min_x_m, within.max_x_m, "x");
  read_place("y_m", "y of its axis", landmark.y_m, within.min_y_m, within.max_y_m, "y");
  section.number("radius_m", {"its radius", kMetres, kAboveZero}, landmark.radius_m);
  return landmark;
}

void read_landmarks(Section& map, const std::optional<Bounds>& bounds, Map& read) {
  std::vector<Landmark>& landmarks = read.landmarks;
  const std::optional<LandmarkSigma> common = read_sigma(map, "landmark_sigma_m");
  for (Section* section : map.sections("landmarks", "the known upright cylinders, a list")) {
    Landmark landmark = read_landmark(*section, bounds);
    if (!landmark.name.empty() && std::ranges::find(landmarks, landmark.name, &Landmark::name) != landmarks.end()) {
      section->complain("name", kNoUnit, "unlike every other landmark's");
    }
    const auto has_number = [&](const Landmark& other) {
      return other.bands && landmark.bands && other.bands->number == landmark.bands->number;
    };
    if (std::ranges::any_of(landmarks, has_number)) {
      section->complain("bands", kNoUnit, "unlike every other landmark's: the number identifies it");
    }
    const std::optional<LandmarkSigma> own = read_sigma(*section, "sigma_m");
    if (!own && !common) read.without_sigma.push_back(landmark.name);
    landmark.sigma = own.value_or(common.value_or(kTapeSigma));
    landmarks.push_back(std::move(landmark));
  }
}

void read_polygon(Section& obstacle, std::vector<Obstacle>& obstacles) {
  Polygon polygon;
  if (!obstacle.points("polygon_m", "corners", polygon)) return;
  if (polygon.size() < 3) {
    obstacle.complain("polygon_m", kMetres, "at least 3 corners");
  } else if (!is_simple(polygon)) {
    obstacle.complain("polygon_m", kMetres, "corners in turn, each once, of an outline that does not cross itself");
  } else {
    obstacles.emplace_back(std::move(polygon));
  }
}

void read_circle(Section& obstacle, std::vector<Obstacle>& obstacles) {
  Section* section = obstacle.section("circle_m", "{x, y, radius}");
  if (section == nullptr) return;
  Disc circle;
  section->number("x", {"x of its centre", kMetres, kAnyNumber}, circle.centre.x_m);
  section->number("y", {"y of its centre", kMetres, kAnyNumber}, circle.centre.y_m);
  section->number("radius", {"its radius", kMetres, kAboveZero}, circle.radius_m);
  obstacles.emplace_back(circle);
}

void read_obstacles(Section& map, std::vector<Obstacle>& obstacles) {
  for (Section* obstacle : map.sections("obstacles", "what stands on the floor, a list", Need::kOptional)) {
    const bool has_polygon = obstacle->has("polygon_m");
    const bool has_circle = obstacle->has("circle_m");
    if (has_polygon == has_circle) {
      obstacle->complain_here(has_polygon ? "has polygon_m and circle_m, must have one of them"
                                          : "has neither polygon_m nor circle_m, must have one of them");
    }
    if (has_polygon) read_polygon(*obstacle, obstacles);
    if (has_circle) read_circle(*obstacle, obstacles);
  }
}

bool lies_within(const Point& point, const Bounds& bounds) {
  return point.x_m >= bounds.min_x_m && point.x_m <= bounds.max_x_m && point.y_m >= bounds.min_y_m &&
         point.y_m <= bounds.max_y_m;
}

/// Returns the rule that the path breaks, or an empty text.
std::string fault_of(const Moving& moving, const std::optional<Bounds>& bounds) {
  const std::vector<Point>& path = moving.path_m;
  if (path.size() < 2) return "at least 2 points";
  if (std::ranges::adjacent_find(path) != path.end()) return "a path whose neighbouring points differ";
  if (moving.loop && path.front() == path.back()) return "a path whose last point is not its first: loop leads back";
  const auto is_out = [&](const Point& point) { return bounds && !lies_within(point, *bounds); };
  if (std::ranges::any_of(path, is_out)) return "within bounds_m";
  return "";
}

void read_moving(Section& map, const std::optional<Bounds>& bounds, std::vector<Moving>& things) {
  for (Section* section : map.sections("moving", "what moves by itself, a list", Need::kOptional)) {
    Moving moving;
    if (section->text("name", "its name: the scene calls it moving.NAME", moving.name)) {
      if (!is_name(moving.name, "_")) {
        section->complain("name", kNoUnit, "letters, digits and _");
      } else if (std::ranges::find(things, moving.name, &Moving::name) != things.end()) {
        section->complain("name", kNoUnit, "unlike every other moving thing's");
      }
    }
    const bool has_path = section->points("path_m", "the points that it goes to in turn", moving.path_m);
    section->number("speed_mps", {"its speed", kMetresPerSecond, kAboveZero}, moving.speed_mps);
    section->flag("loop", "whether it goes round", moving.loop, Need::kOptional);
    section->number("radius_m", {"radius of the disc that stops a robot", kMetres, kAboveZero}, moving.radius_m);
    if (has_path) {
      const std::string rule = fault_of(moving, bounds);
      if (!rule.empty()) section->complain("path_m", kMetres, rule);
    }
    things.push_back(std::move(moving));
  }
}

void read_effects(Section& map, SceneEffects& effects, sim_povray::RendererKind& renderer) {
  Section* section = map.section("effects", "which of the scene's effects are rendered", Need::kOptional);
  if (section == nullptr) return;
  section->flag("shadows", "", effects.shadows, Need::kOptional);
  section->flag("area_lights", "", effects.area_lights, Need::kOptional);
  section->flag("photons", "", effects.photons, Need::kOptional);
  section->flag("radiosity", "", effects.radiosity, Need::kOptional);
  section->flag("media", "", effects.media, Need::kOptional);
  const Quantity reflection_depth{"reflections of reflections", kNoUnit, {.least = 1, .greatest = 256}};
  section->whole("reflection_depth", reflection_depth, effects.reflection_depth);
  std::string name;
  section->text("renderer", "which program renders", name, Need::kOptional);
  if (name.empty()) return;
  if (const auto named = sim_povray::renderer_named(name)) {
    renderer = *named;
  } else {
    section->complain("renderer", kNoUnit, "auto, native or povray");
  }
}

void read_scene_paths(Section& map, const std::filesystem::path& file, std::vector<std::filesystem::path>& paths) {
  std::vector<std::string> folders;
  map.texts("scene_paths", "folders that the scene may read, a list", folders, Need::kOptional);
  for (const std::string& folder : folders) {
    paths.push_back(std::filesystem::absolute(resolve(folder, file)).lexically_normal());
  }
}

/// The scene of a map file may read the folder of that file. A map inside another file (run.yaml) lists that folder.
Map with_own_folder(Map map) {
  if (!map.scene) return map;
  map.scene_paths.insert(map.scene_paths.begin(), std::filesystem::absolute(map.file).parent_path().lexically_normal());
  return map;
}

/// Returns twice the signed area of the triangle, > 0 if it is counter-clockwise.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m);
}

/// Requires `p` in line with a and b. Returns whether it lies between them, ends included.
bool is_between(const Point& p, const Point& a, const Point& b) {
  return std::min(a.x_m, b.x_m) <= p.x_m && p.x_m <= std::max(a.x_m, b.x_m) && std::min(a.y_m, b.y_m) <= p.y_m &&
         p.y_m <= std::max(a.y_m, b.y_m);
}

bool meet(const Point& a, const Point& b, const Point& c, const Point& d) {
  const double abc = turn(a, b, c);
  const double abd = turn(a, b, d);
  const double cda = turn(c, d, a);
  const double cdb = turn(c, d, b);
  // The signs are compared, because a product of two small areas would underflow.
  const auto apart = [](double p, double q) { return (p > 0 && q < 0) || (p < 0 && q > 0); };
  if (apart(abc, abd) && apart(cda, cdb)) return true;
  return (abc == 0 && is_between(c, a, b)) || (abd == 0 && is_between(d, a, b)) || (cda == 0 && is_between(a, c, d)) ||
         (cdb == 0 && is_between(b, c, d));
}

/// Returns whether the edge b-c runs back over a-b.
bool folds_back(const Point& a, const Point& b, const Point& c) {
  const double along = (a.x_m - b.x_m) * (c.x_m - b.x_m) + (a.y_m - b.y_m) * (c.y_m - b.y_m);
  return turn(a, b, c) == 0 && along > 0;
}

}  // namespace

bool is_simple(const Polygon& corners) {
  const std::size_t count = corners.size();
  if (count < 3) return false;
  const auto corner = [&](std::size_t i) -> const Point& { return corners[i % count]; };
  for (std::size_t i = 0; i < count; ++i) {
    if (corner(i) == corner(i + 1) || folds_back(corner(i), corner(i + 1), corner(i + 2))) return false;
    // Skips the edges next to edge i. The last edge is next to edge 0.
    for (std::size_t j = i + 2; j < count && j - i < count - 1; ++j) {
      if (meet(corner(i), corner(i + 1), corner(j), corner(j + 1))) return false;
    }
  }
  return true;
}

Map parse_map(const YAML::Node& node, const std::filesystem::path& file) {
  if (node.IsDefined() && node.IsMap() && node["rig"] && !node["landmarks"]) {
    throw FileError("{}: is a robot file; a map is wanted, the file that its key `map:` names", file.string());
  }
  Reading reading(node, file);
  Section& root = reading.root();
  Map map;
  map.file = file;
  std::string scene;
  root.text("scene", "the POV-Ray file", scene, Need::kOptional);
  if (!scene.empty()) map.scene = resolve(scene, file);
  read_scene_paths(root, file, map.scene_paths);
  root.number("unit_m", {"length of one POV-Ray unit of the scene", kMetres, kAboveZero}, map.unit_m,
              root.has("scene") ? Need::kRequired : Need::kOptional);
  const std::optional<Bounds> bounds = read_bounds(root);
  map.bounds = bounds.value_or(Bounds{});
  read_landmarks(root, bounds, map);
  std::string survey;
  root.text("survey", "the covariance that `twocone survey` wrote", survey, Need::kOptional);
  if (!survey.empty()) map.survey = resolve(survey, file);
  read_obstacles(root, map.obstacles);
  read_moving(root, bounds, map.moving);
  read_effects(root, map.effects, map.renderer);
  reading.finish();
  return map;
}

Map read_map(const std::filesystem::path& file) {
  if (file.extension() == ".pov" || file.extension() == ".inc") {
    throw FileError("{0}: is a POV-Ray scene; a map is wanted, a YAML file that names the scene: `scene: {1}`",
                    file.string(), file.filename().string());
  }
  return with_own_folder(parse_map(load_yaml(file), file));
}

YAML::Node load_map_node(const std::filesystem::path& file) {
  YAML::Node node = load_yaml(file);
  const Map map = with_own_folder(parse_map(node, file));
  if (!map.survey.empty()) node["survey"] = std::filesystem::absolute(map.survey).string();
  if (!map.scene) return node;
  node["scene"] = std::filesystem::absolute(*map.scene).string();
  node["scene_paths"] = YAML::Node(YAML::NodeType::Sequence);
  for (const std::filesystem::path& folder : map.scene_paths) node["scene_paths"].push_back(folder.string());
  return node;
}

}  // namespace twocone::config

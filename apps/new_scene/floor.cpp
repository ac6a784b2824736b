// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <regex>

#include <fmt/format.h>

#include "apps/new_scene/parts.h"

namespace twocone::new_scene {
namespace {

/// A floor is flat: its normals are vertical to within rounding. The ground of a landscape is none.
constexpr double kLevel = 1 - 1e-10;
/// Rays through the scene's own image.
constexpr int kColumns = 96, kRows = 72;
/// A floor that fills less of the image is a detail of it.
constexpr double kLeastShare = 0.02;
/// Height of a person's eyes: scenes are mostly seen by somebody who stands in them.
constexpr double kEye_m = 1.5;

struct Seen {
  SceneGeometry::Surface surface;
  double distance;  // from the camera over the floor
};

/// Surfaces at one height.
struct Level {
  std::vector<Seen> seen;
};

/// Sorts level surfaces by height. @param step heights that differ by less are one
void add(std::map<long, Level>& levels, double step, const Seen& seen) {
  if (std::abs(seen.surface.normal.y) < kLevel) return;
  levels[std::lround(seen.surface.point.y / step)].seen.push_back(seen);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns the length of a unit as a comment of the scene states it: `1 POV-Ray unit = 5 cm`.
std::optional<std::pair<double, int>> stated_unit(const std::filesystem::path& scene) {
  static const std::regex kStatement(R"(//.*\b1\s+(?:POV-?Ray\s+)?unit\s*=\s*([0-9.]+)\s*(mm|cm|m|metres?|meters?)\b)",
                                     std::regex::icase);
  const std::map<char, double> lengths{{'c', 0.01}, {'C', 0.01}};
  std::ifstream file(scene);
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    std::smatch found;
    // Lines of data would take the expression long.
    if (line.size() > 200 || !std::regex_search(line, found, kStatement)) continue;
    const std::string name = found[2];
    const double length_m = name == "mm" || name == "MM" ? 1e-3 : lengths.contains(name[0]) ? 1e-2 : 1;
    const double value = std::atof(found[1].str().c_str()) * length_m;
    if (value > 0) return std::pair(value, number);
  }
  return std::nullopt;
}

/// Returns the number 1, 2 or 5 times a power of ten that is nearest, by ratio.
double rounded(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  double best = power;
  for (const double step : {2.0, 5.0, 10.0}) {
    if (std::abs(std::log(value / (step * power))) < std::abs(std::log(value / best))) best = step * power;
  }
  return best;
}

/// Looks through the scene's own camera.
std::map<long, Level> levels_in_image(const SceneGeometry& geometry, const sim_povray::PerspectiveCamera& camera,
                                      double step) {
  std::map<long, Level> levels;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Vec3 direction =
          camera.direction + camera.right * ((column + 0.5) / kColumns - 0.5) + camera.up * (0.5 - (row + 0.5) / kRows);
      const auto met = geometry.nearest(camera.location, normalized(direction));
      if (!met || met->point.y >= camera.location.y) continue;
      add(levels, step, {*met, std::hypot(met->point.x - camera.location.x, met->point.z - camera.location.z)});
    }
  }
  return levels;
}

/// Looks straight down on what is finite.
std::map<long, Level> levels_from_above(const SceneGeometry& geometry, const Bounds3& around, double step) {
  std::map<long, Level> levels;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Vec3 above{around.low.x + (around.high.x - around.low.x) * (column + 0.5) / kColumns, around.high.y + 1,
                       around.low.z + (around.high.z - around.low.z) * (row + 0.5) / kRows};
      if (const auto met = geometry.nearest(above, {0, -1, 0})) add(levels, step, {*met, 0});
    }
  }
  return levels;
}

const Level* largest(const std::map<long, Level>& levels) {
  const auto best = std::ranges::max_element(levels, {}, [](const auto& item) { return item.second.seen.size(); });
  if (best == levels.end() || double(best->second.seen.size()) < kLeastShare * kColumns * kRows) return nullptr;
  return &best->second;
}

/// A box around the finite solids, without the few that are far larger than the others: skies.
std::optional<Bounds3> extent(const SceneGeometry& geometry) {
  std::vector<double> sizes;
  const auto size = [](const Bounds3& box) { return std::hypot(box.high.x - box.low.x, box.high.z - box.low.z); };
  for (const auto& solid : geometry.solids()) {
    if (solid.bounds) sizes.push_back(size(*solid.bounds));
  }
  if (sizes.empty()) return std::nullopt;
  const double most = 100 * median(sizes);
  std::optional<Bounds3> result;
  for (const auto& solid : geometry.solids()) {
    if (!solid.bounds || size(*solid.bounds) > most) continue;
    const Bounds3& box = *solid.bounds;
    if (!result) result = box;
    result->low = {std::min(result->low.x, box.low.x), std::min(result->low.y, box.low.y),
                   std::min(result->low.z, box.low.z)};
    result->high = {std::max(result->high.x, box.high.x), std::max(result->high.y, box.high.y),
                    std::max(result->high.z, box.high.z)};
  }
  return result;
}

}  // namespace

Floor find_floor(const SceneGeometry& geometry, const RoomSettings& settings) {
  const std::optional<Bounds3> around = extent(geometry);
  const auto& camera = geometry.camera();
  const double height = around ? around->high.y - around->low.y : camera ? std::abs(camera->location.y) : 1;
  // Heights of one floor agree to within rounding.
  const double step = std::max(1e-9, 1e-5 * height);
  if (camera && std::abs(camera->right.y) > 0.5 * length(camera->right)) {
    throw NoPlace("{}: its camera does not stand upright: a robot needs a scene in which y is up",
                  settings.scene.string());
  }
  std::map<long, Level> levels;
  const Level* level = nullptr;
  if (camera) {
    levels = levels_in_image(geometry, *camera, step);
    level = largest(levels);
  }
  const bool is_shown = level != nullptr;
  if (!is_shown && around) {
    levels = levels_from_above(geometry, *around, step);
    level = largest(levels);
  }
  if (level == nullptr) {
    throw NoPlace("{}: no floor was found: neither the scene's camera nor a view from above shows a level surface",
                  settings.scene.string());
  }

  Floor floor;
  std::vector<double> heights;
  for (const Seen& seen : level->seen) heights.push_back(seen.surface.point.y);
  floor.y = median(heights);
  const auto& solid = geometry.solids()[level->seen[level->seen.size() / 2].surface.solid];
  floor.place = fmt::format("{}, {}", solid.kind, solid.place);

  if (settings.unit_m) {
    floor.unit_m = *settings.unit_m;
    floor.why_unit = "--unit-m";
  } else if (const auto stated = stated_unit(settings.scene)) {
    floor.unit_m = stated->first;
    floor.why_unit = fmt::format("a comment of the scene, {}:{}", settings.scene.string(), stated->second);
  } else if (is_shown) {
    floor.unit_m = rounded(kEye_m / (camera->location.y - floor.y));
    floor.why_unit = fmt::format(
        "estimated: the scene's camera is {:.3g} units above the floor, taken as {} m; "
        "--unit-m changes it",
        camera->location.y - floor.y, kEye_m);
  } else {
    constexpr double kAcross_m = 6;
    floor.unit_m = rounded(kAcross_m / std::max(around->high.x - around->low.x, around->high.z - around->low.z));
    floor.why_unit = fmt::format("estimated: the scene is taken as {} m across; --unit-m changes it", kAcross_m);
  }

  // The nearer half of what the camera shows of the floor is where the scene's author looked: horizons are far.
  std::vector<Seen> seen = level->seen;
  std::ranges::sort(seen, {}, &Seen::distance);
  if (is_shown) seen.resize((seen.size() + 1) / 2);
  std::vector<double> x, y;
  for (const Seen& one : seen) {
    x.push_back(one.surface.point.x * floor.unit_m);
    y.push_back(one.surface.point.z * floor.unit_m);
  }
  floor.centre = {median(x), median(y)};
  return floor;
}

}  // namespace twocone::new_scene

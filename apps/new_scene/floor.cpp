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
  sim_povray::SurfacePoint surface;
  double away;  // from below where the ray begins
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns the length of a unit as a comment of the scene states it: `1 POV-Ray unit = 5 cm`.
std::optional<std::pair<double, int>> stated_unit(const std::filesystem::path& scene) {
  static const std::regex kStatement(R"(//.*\b1\s+(?:POV-?Ray\s+)?unit\s*=\s*([0-9.]+)\s*(mm|cm|m|metres?|meters?)\b)",
                                     std::regex::icase);
  std::ifstream file(scene);
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    std::smatch found;
    // Lines of data would take the expression long.
    if (line.size() > 200 || !std::regex_search(line, found, kStatement)) continue;
    const std::string name = found[2];
    const double length_m = name.size() != 2 ? 1 : name[0] == 'm' || name[0] == 'M' ? 1e-3 : 1e-2;
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

/// Returns what rays see of the height at which they meet most level surfaces below them; nothing, if that is little.
/// @param step heights that differ by less are one @param ray_of the ray for two numbers from -1/2 to 1/2
template <class RayOf>
std::vector<Seen> largest_level(const SceneGeometry& geometry, double step, RayOf ray_of) {
  std::map<long, std::vector<Seen>> levels;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const sim_povray::Ray ray = ray_of((column + 0.5) / kColumns - 0.5, 0.5 - (row + 0.5) / kRows);
      const auto met = geometry.cast(ray.origin, normalized(ray.direction));
      if (!met || std::abs(met->normal.z) < kLevel || met->point.z >= ray.origin.z) continue;
      levels[std::lround(met->point.z / step)].push_back(
          {*met, std::hypot(met->point.x - ray.origin.x, met->point.y - ray.origin.y)});
    }
  }
  const auto best = std::ranges::max_element(levels, {}, [](const auto& item) { return item.second.size(); });
  if (best == levels.end() || double(best->second.size()) < kLeastShare * kColumns * kRows) return {};
  return std::move(best->second);
}

/// A box around the finite objects, without the few that are far larger than the others: skies.
std::optional<Bounds3> extent(const SceneGeometry& geometry) {
  std::vector<Bounds3> boxes;
  std::vector<double> sizes;
  const auto size = [](const Bounds3& box) { return std::hypot(box.high.x - box.low.x, box.high.y - box.low.y); };
  for (std::size_t i = 0; i < geometry.objects().size(); ++i) {
    const auto box = geometry.bounds(int(i));
    if (!box || !geometry.objects()[i].is_still) continue;
    boxes.push_back(*box);
    sizes.push_back(size(*box));
  }
  if (boxes.empty()) return std::nullopt;
  std::erase_if(boxes, [&, most = 100 * median(sizes)](const Bounds3& box) { return size(box) > most; });
  Bounds3 result = boxes.front();
  for (const Bounds3& box : boxes) result = around(result, box);
  return result;
}

}  // namespace

Floor find_floor(const SceneGeometry& geometry, const RoomSettings& settings) {
  const std::optional<Bounds3> around = extent(geometry);
  const auto camera = geometry.camera();
  const double height = around ? around->high.z - around->low.z : camera ? std::abs(camera->location.z) : 1;
  // Heights of one floor agree to within rounding.
  const double step = std::max(1e-9, 1e-5 * height);
  if (camera && std::abs(camera->right.z) > 0.5 * length(camera->right)) {
    throw NoPlace("{}: its camera does not stand upright: a robot needs a scene in which y is up",
                  settings.scene.string());
  }
  std::vector<Seen> level;
  if (camera) {
    level = largest_level(geometry, step, [&](double u, double v) -> sim_povray::Ray {
      return {camera->location, camera->direction + camera->right * u + camera->up * v};
    });
  }
  const bool is_shown = !level.empty();
  if (!is_shown && around) {
    const Vec3 middle = (around->low + around->high) / 2, size = around->high - around->low;
    level = largest_level(geometry, step, [&](double u, double v) -> sim_povray::Ray {
      return {{middle.x + size.x * u, middle.y + size.y * v, around->high.z + 1}, {0, 0, -1}};
    });
  }
  if (level.empty()) {
    throw NoPlace("{}: no floor was found: neither the scene's camera nor a view from above shows a level surface",
                  settings.scene.string());
  }

  Floor floor;
  std::ranges::sort(level, {}, [](const Seen& seen) { return seen.surface.point.z; });
  const sim_povray::SurfacePoint& middle = level[level.size() / 2].surface;
  floor.units = middle.point.z;
  const auto& object = geometry.objects()[std::size_t(middle.object)];
  floor.place = fmt::format("{}, {}", object.kind, object.place());

  if (settings.unit_m) {
    floor.unit_m = *settings.unit_m;
    floor.why_unit = "--unit-m";
  } else if (const auto stated = stated_unit(settings.scene)) {
    floor.unit_m = stated->first;
    floor.why_unit = fmt::format("a comment of the scene, {}:{}", settings.scene.string(), stated->second);
  } else if (is_shown) {
    floor.unit_m = rounded(kEye_m / (camera->location.z - floor.units));
    floor.why_unit =
        fmt::format("estimated: the scene's camera is {:.3g} units above the floor, taken as {} m; --unit-m changes it",
                    camera->location.z - floor.units, kEye_m);
  } else {
    constexpr double kAcross_m = 6;
    floor.unit_m = rounded(kAcross_m / std::max(around->high.x - around->low.x, around->high.y - around->low.y));
    floor.why_unit = fmt::format("estimated: the scene is taken as {} m across; --unit-m changes it", kAcross_m);
  }

  // The nearer half of what the camera shows of the floor is where the scene's author looked: horizons are far.
  std::ranges::sort(level, {}, &Seen::away);
  if (is_shown) level.resize((level.size() + 1) / 2);
  std::vector<double> x, y;
  for (const Seen& seen : level) {
    x.push_back(seen.surface.point.x * floor.unit_m);
    y.push_back(seen.surface.point.y * floor.unit_m);
  }
  floor.centre = {median(x), median(y)};
  return floor;
}

}  // namespace twocone::new_scene

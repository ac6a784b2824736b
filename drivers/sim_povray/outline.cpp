// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/place.h"

#include <algorithm>
#include <sstream>
#include <vector>

#include <fmt/format.h>

#include "base/hash.h"

namespace twocone::sim_povray {
namespace {

/// The limit of the text, which must fit into one message (server/protocol.h).
constexpr std::size_t kMostBytes = 4000;

std::string text_of(const FloorPoint& point) { return fmt::format("({:.3f}, {:.3f})", point.x_m, point.y_m); }

std::string text_of(const std::vector<FloorPoint>& points) {
  std::string text;
  for (const FloorPoint& point : points) text += (text.empty() ? "" : " ") + text_of(point);
  return text;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Returns "landmark red" for "landmark red: ...".
std::string name_of(const std::string& line) { return line.substr(0, line.find(": ")); }

const std::string* line_named(const std::vector<std::string>& lines, const std::string& name) {
  const auto found = std::find_if(lines.begin(), lines.end(), [&](const auto& line) { return name_of(line) == name; });
  return found == lines.end() ? nullptr : &*found;
}

}  // namespace

std::string outline_of(const PlaceSettings& place) {
  std::vector<std::string> lines;
  if (place.walls) {
    lines.push_back(fmt::format("walls: x {:.3f} to {:.3f}, y {:.3f} to {:.3f} m", place.walls->min_x_m,
                                place.walls->max_x_m, place.walls->min_y_m, place.walls->max_y_m));
  }
  for (const Solid& solid : place.solids) {
    if (const auto* disc = std::get_if<Disc>(&solid.shape)) {
      lines.push_back(fmt::format("{}: at {} m, radius {:.3f} m", solid.name, text_of(disc->centre), disc->radius_m));
    } else {
      lines.push_back(fmt::format("{}: corners {} m", solid.name, text_of(std::get<Outline>(solid.shape))));
    }
  }
  for (const MovingThing& thing : place.moving) {
    lines.push_back(fmt::format("moving {}: path {} m at {:.3f} m/s, {}, radius {:.3f} m", thing.name,
                                text_of(thing.path_m), thing.speed_mps, thing.loop ? "looping" : "once",
                                thing.radius_m));
  }
  std::string text;
  std::string rest;
  for (const std::string& line : lines) {
    std::string& into = rest.empty() && text.size() + line.size() < kMostBytes ? text : rest;
    into += line + "\n";
  }
  if (!rest.empty()) text += fmt::format("all else: {} bytes, sum {:016x}\n", rest.size(), base::fnv1a(rest));
  return text;
}

std::string first_difference(const std::string& of_map, const std::string& of_world) {
  const auto map = lines_of(of_map);
  const auto world = lines_of(of_world);
  for (const std::string& line : map) {
    const std::string* there = line_named(world, name_of(line));
    if (there == nullptr) return fmt::format("the map has {}, which is not in the world", line);
    if (*there != line) return fmt::format("the map has {}; the world has {}", line, *there);
  }
  for (const std::string& line : world) {
    if (line_named(map, name_of(line)) == nullptr) return fmt::format("the world has {}, which the map has not", line);
  }
  return {};
}

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#include "apps/design/output.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/config/to_layers.h"
#include "apps/design/design.h"
#include "apps/design/units.h"
#include "apps/runlog/version.h"
#include "apps/telemetry/telemetry.h"
#include "apps/web/document.h"
#include "base/quantile.h"

namespace twocone::design {
namespace {

using nlohmann::ordered_json;

ordered_json or_null(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json view_json(const vision::MirrorView& view) {
  const Elevations elevations = elevations_of(view);
  const vision::MirrorViewSettings& settings = view.settings();
  return {{"apex_rad", settings.cone.apex_rad},           {"mirror_radius_m", settings.cone.rim_radius_m},
          {"lens_to_tip_m", settings.cone.lens_to_tip_m}, {"lens_height_m", settings.lens_height_m},
          {"rim_radius_px", settings.rim_radius_px},      {"lowest_rad", elevations.lowest_rad},
          {"highest_rad", elevations.highest_rad}};
}

ordered_json room_json(const config::Map& map, const RoomSigmas& room) {
  ordered_json cells = ordered_json::array();
  for (const RoomCell& cell : room.cells) {
    cells.push_back({cell.x_m, cell.y_m, cell.landmarks, or_null(cell.sigma_m), or_null(cell.heading_rad),
                     or_null(cell.whole_sigma_m)});
  }
  return {{"map", telemetry::map_of(map)},
          {"step_m", room.step_m},
          {"columns", {"x_m", "y_m", "landmarks", "sigma_m", "heading_rad", "whole_sigma_m"}},
          {"cells", cells}};
}

/// A number of the rig's sigma in the unit that people use for it.
std::string sigma_text(const Sensitivity& of) {
  if (of.unit == "m") return fmt::format("{:.3g} mm", in_mm(of.sigma));
  if (of.unit == "rad") return fmt::format("{:.3g} deg", in_degrees(of.sigma));
  return fmt::format("{:.3g}{}{}", of.sigma, of.unit.empty() ? "" : " ", of.unit);
}

struct RoomWords {
  std::size_t cells = 0, placed = 0;
  double median_m = 0, worst_m = 0;
};
RoomWords words_of(const RoomSigmas& room) {
  RoomWords words{room.cells.size(), 0, 0, 0};
  std::vector<double> sigmas_m;
  for (const RoomCell& cell : room.cells) {
    if (cell.sigma_m) sigmas_m.push_back(*cell.sigma_m);
  }
  words.placed = sigmas_m.size();
  if (sigmas_m.empty()) return words;
  words.worst_m = *std::ranges::max_element(sigmas_m);
  words.median_m = base::median(sigmas_m);
  return words;
}

}  // namespace

ordered_json design_json(const Result& result) {
  const vision::Rig rig = config::to_rig(result.robot);
  const Analysis& a = result.analysis;
  ordered_json json{
      {"robot", result.robot.name},
      {"version", fmt::format("twocone {} ({}) {}", runlog::version(), runlog::commit(), runlog::compiler())},
      {"body_radius_m", result.robot.body_radius_m},
      {"image_px", {result.robot.lower.settings.width_px, result.robot.lower.settings.height_px}},
      {"rig",
       {{"lower", view_json(rig.lower)},
        {"upper", view_json(rig.upper)},
        {"mirror_separation_m", rig.mirror_separation_m()}}},
      {"plate_m", kPlate_m},
      {"sigma_px", result.settings.sigma_px},
      {"edge_noise_px", result.settings.edge_noise_px},
      {"nearest_m", or_null(a.reach.nearest_m)},
      {"floor_from_m", or_null(a.reach.floor_from_m)},
      {"least_height_m", or_null(a.reach.least_height_m)}};
  ordered_json distances = ordered_json::array();
  for (const AtDistance& at : a.distances) {
    distances.push_back({{"distance_m", at.distance_m},
                         {"lowest_m", at.shared ? ordered_json(at.shared->lowest_m) : ordered_json(nullptr)},
                         {"highest_m", at.shared ? ordered_json(at.shared->highest_m) : ordered_json(nullptr)},
                         {"least_sigma_m", or_null(at.least_sigma_m)},
                         {"most_sigma_m", or_null(at.most_sigma_m)}});
  }
  json["distances"] = distances;
  ordered_json lines = ordered_json::array();
  for (const SigmaLine& line : a.lines) {
    ordered_json points = ordered_json::array();
    for (const Eigen::Vector2d& point : line.points_m) points.push_back({point.x(), point.y()});
    lines.push_back({{"sigma_m", line.sigma_m}, {"points_m", points}});
  }
  json["sigma_lines"] = lines;
  json["at_m"] = result.settings.at_m;
  json["at_height_m"] = or_null(a.at_height_m);
  ordered_json sensitivities = ordered_json::array();
  for (const Sensitivity& of : a.sensitivities) {
    sensitivities.push_back({{"number", of.number},
                             {"sigma", of.sigma},
                             {"unit", of.unit},
                             {"words", sigma_text(of)},
                             {"range_m", of.range_m}});
  }
  json["sensitivities"] = sensitivities;
  if (a.room && result.map) json["room"] = room_json(*result.map, *a.room);
  return json;
}

std::string page(const Result& result) {
  ordered_json json = design_json(result);
  json["page"] = "design";
  return web::document(json, fmt::format("twocone design: {}", result.robot.name), table(result));
}

std::string table(const Result& result) {
  const vision::Rig rig = config::to_rig(result.robot);
  const Analysis& a = result.analysis;
  std::string text;
  const auto print = [&text]<typename... Values>(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text), format, std::forward<Values>(values)...);
  };
  for (const auto& [name, view] : {std::pair("rig        lower", &rig.lower), {"           upper", &rig.upper}}) {
    const vision::MirrorViewSettings& unit = view->settings();
    print("{} cone {:.1f} deg, R {:.1f} mm, d {:.1f} mm, lens at {:.0f} mm\n", name, in_degrees(unit.cone.apex_rad),
          in_mm(unit.cone.rim_radius_m), in_mm(unit.cone.lens_to_tip_m), in_mm(unit.lens_height_m));
  }
  print("           tips {:.0f} mm apart\n", in_mm(rig.mirror_separation_m()));
  print("cameras    {} x {} px, rims {:.1f} and {:.1f} px\n", result.robot.lower.settings.width_px,
        result.robot.lower.settings.height_px, rig.lower.settings().rim_radius_px, rig.upper.settings().rim_radius_px);
  const Elevations lower = elevations_of(rig.lower);
  const Elevations upper = elevations_of(rig.upper);
  print("elevations lower {:.1f} to {:.1f} deg, upper {:.1f} to {:.1f} deg\n", in_degrees(lower.lowest_rad),
        in_degrees(lower.highest_rad), in_degrees(upper.lowest_rad), in_degrees(upper.highest_rad));
  print("sight      {}\n", words_of(a.reach));
  print("\nSigma of a range by {} px of disparity, and the heights that both mirrors show\n", result.settings.sigma_px);
  print("{:>10} {:>10} {:>10} {:>14} {:>14}\n", "distance/m", "lowest/m", "highest/m", "least sigma/mm",
        "most sigma/mm");
  for (const AtDistance& at : a.distances) {
    if (!at.shared) {
      print("{:10.2f} {:>10} {:>10}\n", at.distance_m, "-", "-");
      continue;
    }
    print("{:10.2f} {:10.2f} {:10.2f} {:14.1f} {:14.1f}\n", at.distance_m, at.shared->lowest_m, at.shared->highest_m,
          in_mm(at.least_sigma_m.value_or(0)), in_mm(at.most_sigma_m.value_or(0)));
  }
  if (!a.sensitivities.empty()) {
    print("\nError of a range at {:.3g} m and {:.2f} m of height by one number that is wrong by its sigma\n",
          result.settings.at_m, a.at_height_m.value_or(0));
    print("{:<28} {:>12} {:>10}\n", "number", "sigma", "range/mm");
    constexpr std::size_t kMost = 12;
    for (std::size_t k = 0; k < std::min(kMost, a.sensitivities.size()); ++k) {
      const Sensitivity& of = a.sensitivities[k];
      print("{:<28} {:>12} {:10.1f}\n", of.number, sigma_text(of), in_mm(of.range_m));
    }
    if (a.sensitivities.size() > kMost) print("and {} smaller ones\n", a.sensitivities.size() - kMost);
  }
  if (a.room && result.map) {
    const RoomWords words = words_of(*a.room);
    print("\nroom       {} landmarks, {} px of noise in their outlines:\n           ", result.map->landmarks.size(),
          result.settings.edge_noise_px);
    if (words.placed == 0) {
      print("no place is determined\n");
    } else {
      print("a place in {:.0f} % of the free floor, sigma {:.2f} mm (median), at worst {:.2f} mm\n",
            100.0 * double(words.placed) / double(words.cells), in_mm(words.median_m), in_mm(words.worst_m));
    }
  }
  return text;
}

}  // namespace twocone::design

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "apps/new_scene/parts.h"
#include "vision/hue_labels.h"

namespace twocone::new_scene {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// Two hues whose windows (vision::HueLabels) do not touch.
constexpr double kApart_rad = 2 * vision::HueLabels::kHueWindow_rad;
/// A landmark that covers half of a pixel must still have the least saturation that vision accepts, in front of a
/// surface a little darker than itself.
constexpr double kLeastSaturation = 0.75;
constexpr double kLeastBrightness = 0.15;
/// Landmarks that both mirrors see: above the tip of the upper one, not too thin to be outlined, not a wall.
constexpr double kLeastTop_m = 0.75, kGreatestTop_m = 3;
constexpr double kLeastRadius_m = 0.03, kGreatestRadius_m = 0.6;
/// Added landmarks: those of the lab.
constexpr double kRadius_m = 0.15, kTop_m = 0.90;
/// Distances at which both mirrors see the top of an added landmark, the best first. A ray by the lower rim, 0.43 m
/// high, rises by 0.06 / 0.18: nearer than 1.41 m it passes below the top.
constexpr std::array kDistances_m{2.4, 2.2, 2.6, 2.0, 2.8, 1.8, 3.0, 1.6, 3.4, 1.5, 1.3, 1.1, 0.9};
/// Nearer to each other, two landmarks would hide each other from many places.
constexpr double kSpacing_m = 0.8;
constexpr int kMostAdded = 6;

struct Hue {
  const char* name;
  std::array<double, 3> colour;
};
/// Hues 30 degrees apart; the first six are the lab's. The program prefers them in this order.
constexpr double kLow = 0.03, kHigh = 0.8, kMiddle = 0.4;
constexpr std::array<Hue, 12> kHues{{{"red", {kHigh, kLow, kLow}},
                                     {"green", {kLow, kHigh, kLow}},
                                     {"blue", {kLow, kLow, kHigh}},
                                     {"cyan", {kLow, kHigh, kHigh}},
                                     {"magenta", {kHigh, kLow, kHigh}},
                                     {"yellow", {kHigh, kHigh, kLow}},
                                     {"azure", {kLow, kMiddle, kHigh}},
                                     {"violet", {kMiddle, kLow, kHigh}},
                                     {"rose", {kHigh, kLow, kMiddle}},
                                     {"spring", {kLow, kHigh, kMiddle}},
                                     {"orange", {kHigh, kMiddle, kLow}},
                                     {"lime", {kMiddle, kHigh, kLow}}}};

/// Returns the name of the nearest hue.
std::string name_of(const std::array<double, 3>& colour) {
  return std::ranges::min_element(kHues, {},
                                  [&](const Hue& hue) { return vision::hue_distance_rad(hue.colour, colour); })
      ->name;
}

double distance_m(const FloorPoint& a, const FloorPoint& b) { return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m); }

/// The hues that may be added, the best first.
std::vector<Hue> free_hues(const SceneGeometry& geometry, const std::vector<FoundLandmark>& present,
                           std::vector<std::string>& warnings) {
  // In scenes of other gamma, colours are more saturated than their text says.
  constexpr double kStrong = 0.4;
  const auto is_weak = [](const sim_povray::Rgb& c) {
    return vision::saturation(c) < kStrong || std::ranges::max(c) < kLeastBrightness;
  };
  std::vector<sim_povray::Rgb> held = geometry.colours();
  const std::vector<sim_povray::Rgb> sky = geometry.sky_colours();
  if (!std::ranges::all_of(sky, is_weak)) {
    warnings.emplace_back("the sky has a strong colour: vision needs pale surroundings, and may find no landmark");
  }
  held.insert(held.end(), sky.begin(), sky.end());
  std::erase_if(held, is_weak);
  std::vector<Hue> chosen;
  const auto add = [&](bool is_free) {
    for (const Hue& hue : kHues) {
      const auto is_near = [&](const std::array<double, 3>& c) {
        return vision::hue_distance_rad(c, hue.colour) < kApart_rad;
      };
      const bool is_taken =
          std::ranges::any_of(present, [&](const FoundLandmark& f) { return is_near(f.landmark.colour); }) ||
          std::ranges::any_of(chosen, [&](const Hue& other) { return is_near(other.colour); });
      if (is_taken || int(chosen.size()) == kMostAdded || std::ranges::any_of(held, is_near) == is_free) continue;
      chosen.push_back(hue);
    }
  };
  add(true);
  const std::size_t free = chosen.size();
  if (present.size() + free < kFewestLandmarks + 1) add(false);
  if (free < chosen.size()) {
    std::string names;
    for (std::size_t i = free; i < chosen.size(); ++i)
      names += fmt::format("{}{}", names.empty() ? "" : ", ", chosen[i].name);
    warnings.push_back(
        fmt::format("the scene has things of the same hue as the added landmarks {}: vision may take one "
                    "for the other",
                    names));
  }
  return chosen;
}

}  // namespace

std::vector<FoundLandmark> scene_landmarks(const SceneGeometry& geometry, const FloorPoint& centre,
                                           std::vector<std::string>& warnings) {
  std::vector<FoundLandmark> found;
  constexpr double kHalf_m = FloorPlan::kCell_m * FloorPlan::kCells / 2;
  for (const sim_povray::SceneCylinder& cylinder : geometry.upright_cylinders()) {
    if (!cylinder.colour) continue;
    const sim_povray::Rgb& colour = *cylinder.colour;
    if (vision::saturation(colour) < kLeastSaturation || std::ranges::max(colour) < kLeastBrightness) continue;
    Landmark landmark{.name = name_of(colour),
                      .colour = colour,
                      .x_m = cylinder.x_m,
                      .y_m = cylinder.y_m,
                      .radius_m = cylinder.radius_m,
                      .top_m = cylinder.top_m};
    for (double& part : landmark.colour) part = std::clamp(part, 0.0, 1.0);
    if (cylinder.bottom_m > FloorPlan::kLow_m || landmark.top_m < kLeastTop_m || landmark.top_m > kGreatestTop_m ||
        landmark.radius_m < kLeastRadius_m || landmark.radius_m > kGreatestRadius_m ||
        std::abs(landmark.x_m - centre.x_m) + landmark.radius_m > kHalf_m ||
        std::abs(landmark.y_m - centre.y_m) + landmark.radius_m > kHalf_m) {
      continue;
    }
    // A thing that stands on it hides the edge of its top.
    if (geometry.cast({landmark.x_m, landmark.y_m, landmark.top_m + 0.001}, {0, 0, 1}, 0.05)) continue;
    found.push_back({landmark, geometry.objects()[std::size_t(cylinder.object)].place(), cylinder.object});
  }
  std::vector<FoundLandmark> result;
  for (FoundLandmark one : found) {
    const auto has_its_hue = [&](const FoundLandmark& other) {
      return vision::hue_distance_rad(one.landmark.colour, other.landmark.colour) < vision::HueLabels::kHueWindow_rad;
    };
    std::string& name = one.landmark.name;
    if (std::ranges::count_if(found, has_its_hue) > 1) {  // one is itself
      warnings.push_back(fmt::format("{}: no landmark, because another cylinder has its hue, {}", one.place, name));
      continue;
    }
    // Names are 30 degrees of hue apart, landmarks more than 20: at most two have one name.
    if (std::ranges::any_of(result, [&](const FoundLandmark& other) { return other.landmark.name == name; }))
      name += " 2";
    result.push_back(one);
  }
  return result;
}

bool sees(const SceneGeometry& geometry, const FloorPoint& from, const Landmark& landmark) {
  constexpr double kFarthest_m = 6;
  const double distance = distance_m(from, {landmark.x_m, landmark.y_m});
  if (distance > kFarthest_m || distance < landmark.radius_m + StandardRobot::kRadius_m) return false;
  for (const double eye_m : {StandardRobot::kLowerTip_m, StandardRobot::kUpperTip_m}) {
    const Vec3 eye{from.x_m, from.y_m, eye_m};
    // Both edges of its top, a little below.
    for (const double side : {-0.7, 0.7}) {
      const double across = side * landmark.radius_m / distance;
      const Vec3 way = Vec3{landmark.x_m - (landmark.y_m - from.y_m) * across,
                            landmark.y_m + (landmark.x_m - from.x_m) * across, landmark.top_m - 0.03} -
                       eye;
      const double most_m = length(way) - landmark.radius_m - 0.02;
      if (most_m > 0 && geometry.cast(eye, normalized(way), most_m)) return false;
    }
  }
  return true;
}

std::vector<FoundLandmark> added_landmarks(const SceneGeometry& geometry, const FloorPlan& plan,
                                           const FloorPoint& start, const std::vector<FoundLandmark>& present,
                                           std::vector<std::string>& warnings) {
  const std::vector<Hue> hues = free_hues(geometry, present, warnings);
  std::vector<FoundLandmark> added;
  const auto stands_well = [&](const Landmark& landmark) {
    const FloorPoint place{landmark.x_m, landmark.y_m};
    if (plan.clearance_m(place) < kRadius_m + FloorPlan::kCell_m) return false;
    for (const auto* others : {&present, &std::as_const(added)}) {
      for (const FoundLandmark& other : *others) {
        if (distance_m(place, {other.landmark.x_m, other.landmark.y_m}) < kSpacing_m) return false;
      }
    }
    return sees(geometry, start, landmark);
  };
  for (std::size_t k = 0; k < hues.size(); ++k) {
    Landmark landmark{.name = hues[k].name, .colour = hues[k].colour, .radius_m = kRadius_m, .top_m = kTop_m};
    const auto place = [&] {
      for (const double turned_deg : {0.0, 10.0, -10.0, 20.0, -20.0, 28.0, -28.0}) {
        // Not a regular polygon: the sides differ, so that few landmarks are not mistaken for each other's places.
        const double angle_rad = (25 + 360.0 * double(k) / double(hues.size()) + turned_deg) * kDegree;
        for (const double d : kDistances_m) {
          landmark.x_m = start.x_m + d * std::cos(angle_rad);
          landmark.y_m = start.y_m + d * std::sin(angle_rad);
          if (stands_well(landmark)) return true;
        }
      }
      return false;
    };
    if (place()) added.push_back({landmark});
  }
  return added;
}

}  // namespace twocone::new_scene

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include "apps/as_built/as_built.h"
#include "apps/config/to_layers.h"
#include "apps/design/design.h"
#include "apps/design/units.h"
#include "apps/runlog/storage/disk.h"
#include "drivers/sim_povray/scene_geometry.h"

namespace twocone::design {
namespace {

constexpr double kLandmarkRadius_m = 0.12;

/// A room of 6 x 5 m. One unit is one metre: world (x, y, z) is <x, z, y>.
constexpr const char* kRoom = R"(#version 3.7;
global_settings { assumed_gamma 1.0 max_trace_level 4 }
background { color rgb 0.75 }
light_source { <-1.2, 2.25, 0.7> color rgb 0.57 }
light_source { <1.3, 2.25, -0.7> color rgb 0.57 }
#declare Room_Matt = finish { ambient 0.30 diffuse 0.62 }
#default { finish { Room_Matt } }
#macro Room_Print(Low, High, Size)
  pigment { bozo turbulence 0.4 color_map { [0.3 rgb Low] [0.7 rgb High] } scale Size }
#end
box { <-3, -0.05, -2.5> <3, 0, 2.5> Room_Print(<0.16, 0.14, 0.12>, <0.52, 0.48, 0.42>, 0.09) no_shadow }
box { <-3, 2.4, -2.5> <3, 2.45, 2.5> pigment { color rgb 0.62 } finish { ambient 1 diffuse 0 } no_shadow }
box { <-3.1, -0.05, 2.5> <3.1, 2.4, 2.6> Room_Print(<0.34, 0.36, 0.38>, <0.74, 0.73, 0.70>, 0.13) no_shadow }
box { <-3.1, -0.05, -2.6> <3.1, 2.4, -2.5> Room_Print(<0.40, 0.39, 0.36>, <0.76, 0.74, 0.72>, 0.11) no_shadow }
box { <3, -0.05, -2.5> <3.1, 2.4, 2.5> Room_Print(<0.30, 0.33, 0.36>, <0.66, 0.70, 0.72>, 0.12) no_shadow }
box { <-3.1, -0.05, -2.5> <-3, 2.4, 2.5> Room_Print(<0.42, 0.38, 0.34>, <0.74, 0.71, 0.68>, 0.15) no_shadow }
)";

/// The six landmarks of the room, as those of the lab.
std::vector<Landmark> landmarks_of_room(double top_m) {
  struct Place {
    const char* name;
    std::array<double, 3> colour;
    double x_m, y_m;
  };
  constexpr std::array<Place, 6> kPlaces{{{"red", {0.80, 0.03, 0.03}, -2.45, -0.35},
                                          {"green", {0.03, 0.80, 0.03}, -1.40, 1.95},
                                          {"blue", {0.03, 0.03, 0.80}, 1.50, 1.95},
                                          {"cyan", {0.03, 0.80, 0.80}, 2.45, 0.30},
                                          {"magenta", {0.80, 0.03, 0.80}, 1.30, -1.95},
                                          {"yellow", {0.80, 0.80, 0.03}, -1.50, -1.95}}};
  std::vector<Landmark> landmarks;
  landmarks.reserve(kPlaces.size());
  for (const auto& [name, colour, x_m, y_m] : kPlaces) {
    landmarks.push_back(
        {.name = name, .colour = colour, .x_m = x_m, .y_m = y_m, .radius_m = kLandmarkRadius_m, .top_m = top_m});
  }
  return landmarks;
}

/// Returns the height of landmarks whose tops both mirrors show at most distances from 1 to 5 m.
double landmark_top_m(const Sight& sight) {
  double best_m = 0;
  int most = -1;
  for (int k = 10; k <= 180; ++k) {
    const double top_m = 0.01 * k;
    int count = 0;
    for (int i = 10; i <= 50; ++i) {
      const double near_m = 0.1 * i - kLandmarkRadius_m;
      // A little room over the top: outlines need what is beside them.
      const auto both = [&](double height_m) {
        return sight.shows(vision::Side::kLower, near_m, height_m) &&
               sight.shows(vision::Side::kUpper, near_m, height_m);
      };
      count += both(top_m) && both(top_m + 0.03) ? 1 : 0;
    }
    if (count > most) {
      most = count;
      best_m = top_m;
    }
  }
  return best_m;
}

/// Returns where the robot starts: the origin, or the widest place if the body has no room there.
Pose2 start_in(const config::Map& map, double body_radius_m) {
  const behaviours::Arena arena = config::to_arena(map);
  Pose2 best;
  double widest_m = arena.clearance_m({0, 0});
  constexpr double kAir_m = 0.1;
  if (widest_m >= body_radius_m + kAir_m) return best;
  constexpr int kSteps = 60;
  for (int row = 1; row < kSteps; ++row) {
    for (int column = 1; column < kSteps; ++column) {
      const Pose2 there{std::lerp(map.bounds.min_x_m, map.bounds.max_x_m, double(column) / kSteps),
                        std::lerp(map.bounds.min_y_m, map.bounds.max_y_m, double(row) / kSteps), 0};
      const double clearance_m = arena.clearance_m({there.x_m, there.y_m});
      if (clearance_m <= widest_m) continue;
      widest_m = clearance_m;
      best = there;
    }
  }
  if (widest_m < body_radius_m) {
    throw base::FormattedError("{}: a body of radius {} m has no room, the widest place has {:.2f} m",
                               map.file.string(), body_radius_m, widest_m);
  }
  return best;
}

std::string text_of_robot(const Design& d, const Files& files, const Pose2& start) {
  const double middle_x = (d.width_px - 1) / 2.0;
  const double middle_y = (d.height_px - 1) / 2.0;
  return fmt::format(
      R"(# SPDX-License-Identifier: Apache-2.0
#
# A robot by `twocone design`, simulated. The lab's robot file explains the keys.
#
#   twocone run --robot {0}
#
# For the robot that you build: name the devices of `cameras:` and `drive:`, measure what you built, and leave
# `sigma: 0` out of `rig:` and `drive:`, because they are exact in a simulation only.

name: {1}
map: {2}
start: {{x_m: {3}, y_m: {4}, heading_rad: {5}}}
latency_frames: 4
body: {{radius_m: {6}}}
drive: {{driver: sim_povray, wheel_separation_m: {7:.3f}, wheel_radius_m: {8:.3f}, max_speed_mps: 0.5, command_timeout_s: 0.5, sigma: 0}}
cameras:
  lower: {{driver: sim_povray, width_px: {9}, height_px: {10}, rate_hz: 15}}
  upper: {{driver: sim_povray, width_px: {9}, height_px: {10}, rate_hz: 15}}
rig:
  mirror: {{type: cone, apex_rad: {11:.17g}}}   # {12:.1f} degrees
  mirror_radius_m: {13:.4f}
  lens_to_tip_m: {14:.4f}
  mirror_separation_m: {15:.4f}
  lens_height_m: {16:.4f}
  sigma: 0
  lower: {{centre_px: [{17}, {18}], rim_radius_px: {19:.4f}, azimuth_rad: 0.0}}
  upper: {{centre_px: [{17}, {18}], rim_radius_px: {19:.4f}, azimuth_rad: 0.0}}
effects: {{slip: 0.01, encoder_counts_per_turn: 1024}}
)",
      files.robot.string(), files.robot.stem().string(), files.map.filename().string(), start.x_m, start.y_m,
      start.heading_rad, d.body_radius_m, 1.5 * d.body_radius_m, 0.25 * d.body_radius_m, d.width_px, d.height_px,
      d.apex_rad, in_degrees(d.apex_rad), d.mirror_radius_m, d.lens_to_tip_m, d.mirror_separation_m, d.lens_height_m,
      middle_x, middle_y, d.rim_radius_px);
}

std::string text_of_own_map(const Files& files, const std::vector<Landmark>& landmarks) {
  std::string text = fmt::format(
      "# SPDX-License-Identifier: Apache-2.0\n#\n# Map of {0}, by `twocone design`: a room with landmarks that both "
      "mirrors of the robot show.\nscene: {0}\nunit_m: 1\nbounds_m: {{x: [-3, 3], y: [-2.5, 2.5]}}\nlandmark_sigma_m: "
      "0\nlandmarks:\n",
      files.scene.filename().string());
  for (const Landmark& l : landmarks) {
    fmt::format_to(std::back_inserter(text),
                   "  - {{name: {}, colour: [{}, {}, {}], x_m: {}, y_m: {}, radius_m: {}, top_m: {:.2f}}}\n", l.name,
                   l.colour[0], l.colour[1], l.colour[2], l.x_m, l.y_m, l.radius_m, l.top_m);
  }
  return text;
}

/// Returns a scene's text without its robot, or one that includes a scene that has none.
std::string room_text(const std::filesystem::path& scene) {
  const auto copy = sim_povray::text_without_robot(scene);
  if (!copy) throw base::FormattedError("{}", copy.error().message);
  if (copy->empty()) return fmt::format("#include \"{}\"\n", scene.string());
  return *copy + fmt::format("\n// ---- above: a copy of {} without its robot\n", scene.filename().string());
}

}  // namespace

Files files_in(const std::filesystem::path& folder, const std::string& name) {
  constexpr std::string_view kGood = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
  if (name.empty() || name.find_first_not_of(kGood) != std::string::npos) {
    throw base::InvalidArgument("name is '{}', must be letters, digits, _ and -", name);
  }
  return {folder / (name + ".yaml"), folder / (name + ".map.yaml"), folder / (name + ".pov"),
          folder / (name + ".dxf"),  folder / "index.html",         folder / "design.json"};
}

void write_robot(const Design& design, const std::optional<config::Map>& room, const Files& files) {
  runlog::make_folder(files.robot.parent_path());
  as_built::AsBuilt exact;  // no flaws, and no landmarks of its own but in the room of this folder
  std::string scene;
  Pose2 start;
  if (room) {
    if (!room->scene) {
      throw base::FormattedError("{}: scene is missing: the POV-Ray file, a copy of which gets the robot",
                                 room->file.string());
    }
    scene = room_text(*room->scene);
    exact.built_map.unit_m = room->unit_m;
    start = start_in(*room, design.body_radius_m);
    config::Map map = *room;
    map.scene = files.scene.filename();
    runlog::write_whole(
        files.map, config::map_text(room->file, files.map, map,
                                    {fmt::format("Map of {}, by `twocone design`.", files.scene.filename().string())}));
  } else {
    scene = kRoom;
    exact.built_map.unit_m = 1;
    exact.built_map.landmarks = landmarks_of_room(landmark_top_m(sight_of(design)));
    exact.landmarks.resize(exact.built_map.landmarks.size());
    runlog::write_whole(files.map, text_of_own_map(files, exact.built_map.landmarks));
  }
  runlog::write_whole(files.robot, text_of_robot(design, files, start));
  exact.built = config::read_robot(files.robot);
  runlog::write_whole(files.scene,
                      fmt::format("// SPDX-License-Identifier: Apache-2.0\n//\n// {}: by `twocone design`\n{}{}",
                                  files.scene.filename().string(), scene, as_built::scene_text(exact)));
  runlog::write_whole(files.profile, profile_dxf(design));
}

std::string profile_dxf(const Design& design) {
  std::string text =
      "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$MEASUREMENT\n70\n1\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n";
  const auto line = [&](const char* layer, double x1_m, double y1_m, double x2_m, double y2_m) {
    fmt::format_to(std::back_inserter(text),
                   "0\nLINE\n8\n{}\n10\n{:.4f}\n20\n{:.4f}\n30\n0\n11\n{:.4f}\n21\n{:.4f}\n31\n0\n", layer, in_mm(x1_m),
                   in_mm(y1_m), in_mm(x2_m), in_mm(y2_m));
  };
  const double radius_m = design.mirror_radius_m;
  const double rim_m = design.cone_height_m();
  const double back_m = rim_m + kPlate_m;
  line("MIRROR", 0, 0, radius_m, rim_m);
  line("BODY", radius_m, rim_m, radius_m, back_m);
  line("BODY", radius_m, back_m, 0, back_m);
  line("AXIS", 0, 0, 0, back_m);
  return text + "0\nENDSEC\n0\nEOF\n";
}

}  // namespace twocone::design

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/plane.h"

namespace twocone::sim_povray {

using Outline = std::vector<FloorPoint>;  ///< corners of a simple polygon, at least three

/// An obstacle that stands on the floor and stops a robot.
struct Solid {
  std::string name;  ///< name in messages: "landmark red", "obstacle 3"
  std::variant<Disc, Outline> shape{};
};

/// An object that moves along a path by itself. It is at path_m[0] at time 0, faces along its path and moves at
/// constant speed. If it loops, it returns to the first point on a straight line; otherwise it stops at the last point.
/// The scene shows it at path_m[0], facing along the first segment, as the object `moving.NAME`.
struct MovingThing {
  std::string name;                  ///< without `moving.`
  std::vector<FloorPoint> path_m{};  ///< at least two points, no two neighbours equal
  double speed_mps = 0;              ///< > 0
  bool loop = false;
  double radius_m = 0;  ///< radius of the disc that stops a robot, > 0

  friend bool operator==(const MovingThing&, const MovingThing&) = default;
};

/// Rendering effects that the map switches off or changes, although the scene's text uses them.
struct SceneSwitches {
  bool shadows = true;
  bool area_lights = true;  ///< off: a point light at the area's centre
  bool photons = true;
  bool radiosity = true;
  bool media = true;                      ///< media and fog
  std::optional<int> reflection_depth{};  ///< replaces the scene's max_trace_level, 1 to 256

  friend bool operator==(const SceneSwitches&, const SceneSwitches&) = default;
};

/// Greatest width and height of an image. Its size in bytes does not overflow.
constexpr int kMaxSide_px = 16384;

/// The program's own renderer is many times faster than POV-Ray, but knows only a part of its language.
enum class RendererKind {
  kAuto,    ///< the native renderer where its first image agrees with POV-Ray's, else POV-Ray
  kNative,  ///< the native renderer, unchecked
  kPovray,
};

/// Returns "auto", "native" or "povray".
std::string_view to_string(RendererKind kind);
/// Returns the kind of that name. Nothing: there is none.
std::optional<RendererKind> renderer_named(std::string_view name);

/// The settings of rendering. The defaults suit two cores.
struct RenderSettings {
  RendererKind renderer = RendererKind::kAuto;
  std::string povray = "povray";  ///< the program: a path, or a name looked up in PATH
  int processes = 8;              ///< POV-Ray processes at one time, >= 1; more than cores, since each sleeps at times
  bool hold = true;               ///< keep processes between images; off: one process per image
  bool whole_image = false;       ///< also render the pixels outside the mirror
  bool landlock = true;           ///< confine POV-Ray by Landlock if the kernel has it; off: as on a kernel without
  std::chrono::milliseconds timeout{120'000};  ///< time limit of one image, > 0; then the process is killed
  /// Called from any thread with a line for a person when rendering falls back to a slower method, with the reason.
  std::function<void(const std::string&)> notice{};
  /// Called from any thread, before the first image, with the renderer that was chosen (not kAuto) and whether it was
  /// compared with POV-Ray.
  std::function<void(RendererKind, bool is_checked)> chosen{};
};

/// A scene with everything in it except robots.
struct PlaceSettings {
  std::filesystem::path scene{};  ///< a POV-Ray file
  /// Folders that the scene may read, with all their sub-folders, in addition to POV-Ray's libraries. The scene may not
  /// write any file. Empty: the scene's own folder.
  std::vector<std::filesystem::path> scene_paths{};
  double unit_m = 0.05;           ///< metres in one POV-Ray unit, > 0
  std::optional<Bounds> walls{};  ///< positions of the inner faces
  std::vector<Solid> solids{};
  std::vector<MovingThing> moving{};
  SceneSwitches switches{};
  RenderSettings render{};
};

/// @throws std::invalid_argument naming every bad field
void check(const PlaceSettings& settings);
void check(const RenderSettings& settings);

/// Describes the walls, solids and moving things of a place in text, one line each, to a millimetre. The programs of
/// one world must agree on it. At most 4 kB: a checksum replaces the lines beyond that.
std::string outline_of(const PlaceSettings& place);

/// Returns the first difference between the outline_of() of the robot's map and that of the world, as a message; empty:
/// they agree.
std::string first_difference(const std::string& of_map, const std::string& of_world);

}  // namespace twocone::sim_povray

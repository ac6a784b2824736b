// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/plane.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/render/native/ray.h"
#include "drivers/sim_povray/scene/evaluator.h"
#include "drivers/sim_povray/scene_views.h"
#include "hal/image.h"
#include "hal/result.h"

/// Where the surfaces of a scene are, by the program's own evaluation of its text. Points, directions and boxes are in
/// the world's frame, in metres.
namespace twocone::sim_povray {

using Rgb = std::array<double, 3>;  ///< in linear light

/// An object of the scene. The parts of a union are objects of their own.
struct SceneObject {
  std::string kind{};  ///< POV-Ray's keyword: "box", "cylinder", "difference"; "shape": only a bound of it is known
  std::string file{};  ///< where its statement begins; that of a macro is in the macro's body
  int line = 0;
  bool is_still = false;  ///< it stands still and is seen in mirrors; all questions but overhead() concern these alone

  [[nodiscard]] std::string place() const;     ///< "scenes/lab.pov:123"
  [[nodiscard]] std::string describe() const;  ///< "cylinder of scenes/lab.pov:123"
};

struct SurfacePoint {
  double distance_m = 0;  ///< from the ray's origin
  Vec3 point{};
  Vec3 normal{};   ///< of length 1, towards either side
  Rgb colour{};    ///< of the pigment there; black if a lenient evaluation did not understand it
  int object = 0;  ///< its index in SceneGeometry::objects()
};

/// A closed upright cylinder, not clipped and not a part of a difference or intersection.
struct SceneCylinder {
  double x_m = 0, y_m = 0;
  double radius_m = 0;
  double bottom_m = 0, top_m = 0;
  std::optional<Rgb> colour{};  ///< nothing: its pigment is not one colour, or not understood
  int object = 0;
};

/// Square cells of the floor, row by row from the corner of least x and y.
struct FloorGrid {
  FloorPoint corner{};
  double cell_m = 0;
  int columns = 0, rows = 0;

  [[nodiscard]] std::size_t size() const { return std::size_t(columns) * std::size_t(rows); }
  [[nodiscard]] FloorPoint centre(std::size_t cell) const;
};

/// The still parts of a scene: all objects but the blocks `robot`, `robot.NAME` and `moving.NAME`, and those that no
/// mirror shows. May be used by several threads at once.
class SceneGeometry {
 public:
  /// Errors: kNotFound, kRefused: `FILE:LINE: ...`, the program does not know a construct of the scene, or it is wrong.
  /// @param leniency not null: the scene is evaluated leniently (EvaluatorSettings::leniency), and overhead() has no
  /// lights
  static Result<SceneGeometry> read(const PlaceSettings& place, Leniency* leniency = nullptr);
  /// Returns the same scene with another length of a unit, and with the world's floor at another height of the scene.
  /// @param floor_units its y in POV-Ray units
  [[nodiscard]] SceneGeometry in_frame(double unit_m, double floor_units) const;

  [[nodiscard]] const std::vector<SceneObject>& objects() const;
  /// A box around an object; nothing: it is infinite.
  [[nodiscard]] std::optional<Bounds3> bounds(int object) const;
  /// Returns the first surface that a ray meets, within `farthest_m`. The very nearest 1e-4 POV-Ray units are not
  /// looked at. @param direction of length 1
  [[nodiscard]] std::optional<SurfacePoint> cast(const Vec3& origin, const Vec3& direction,
                                                 double farthest_m = std::numeric_limits<double>::infinity()) const;
  /// Returns whether the point is inside of an object by POV-Ray's rules: below a plane, for example.
  [[nodiscard]] bool contains(int object, const Vec3& point) const;
  /// Returns 255 for each cell of the grid in which the object is, between two heights, and 0 for the others. What is
  /// thinner than a third of a cell may be missed, unless the whole object has less than two cells in x and y.
  /// @param air a point in the open: an object that holds it is seen from inside, as a room or a sky, and counts with
  /// its surface alone, as do infinite objects
  [[nodiscard]] std::vector<std::uint8_t> cells_of(int object, const FloorGrid& grid, double low_m, double high_m,
                                                   const Vec3& air) const;
  [[nodiscard]] std::vector<SceneCylinder> upright_cylinders() const;

  /// The scene's camera: the last of its text; in a strict evaluation, of those without a name. Nothing: it has none
  /// that is understood.
  [[nodiscard]] std::optional<PerspectiveCamera> camera() const;
  /// Return the colours that the text gives to what stands still and to the sky.
  [[nodiscard]] std::vector<Rgb> colours() const;
  [[nodiscard]] std::vector<Rgb> sky_colours() const;

  /// Renders the scene from above, as render_overhead(), with all lights. What the height of the view cuts is dark, as
  /// in an architect's plan. The robots stand where the scene shows them.
  /// @throws std::invalid_argument as render_overhead
  [[nodiscard]] Image overhead(const OverheadView& view) const;

 private:
  struct Content;
  SceneGeometry(std::shared_ptr<const Content> content, double unit_m, double floor_units)
      : content_(std::move(content)), unit_m_(unit_m), floor_units_(floor_units) {}

  [[nodiscard]] Vec3 to_scene(const Vec3& point) const;
  [[nodiscard]] Vec3 to_world(const Vec3& point) const;

  std::shared_ptr<const Content> content_;
  double unit_m_, floor_units_;
};

/// Returns the text of a scene without its robot's blocks, `robot`, `lower` and `upper` and those of further robots;
/// line numbers do not change. Empty: it names none. Errors: kNotFound, kRefused, as Scene::read; kRefused: such a
/// block is a part of another statement.
Result<std::string> text_without_robot(const std::filesystem::path& scene);

}  // namespace twocone::sim_povray

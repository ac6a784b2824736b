// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/scene_views.h"
#include "hal/image.h"
#include "hal/result.h"

/// Where the surfaces of a scene are, by the program's own evaluation of its text. Points and directions are in the
/// world's frame, in metres.
namespace twocone::sim_povray {

using WorldVector = std::array<double, 3>;

/// An object of the scene. The parts of a union are objects of their own.
struct SceneObject {
  std::string kind{};  ///< POV-Ray's keyword: "box", "cylinder", "difference"
  std::string name{};  ///< `//*PMName` of the block that it is or belongs to; empty: none
  std::string file{};  ///< where its statement begins; that of a macro is in the macro's body
  int line = 0;

  /// "cylinder of scenes/lab.pov:123"
  [[nodiscard]] std::string describe() const;
};

struct SurfacePoint {
  double distance_m = 0;           ///< from the ray's origin
  std::array<double, 3> colour{};  ///< of the pigment there, linear rgb
  int object = 0;                  ///< its index in SceneGeometry::objects()
};

/// An upright cylinder, not clipped and not a part of a difference or intersection.
struct SceneCylinder {
  double x_m = 0, y_m = 0;
  double radius_m = 0;
  double bottom_m = 0, top_m = 0;
  std::array<double, 3> colour{};  ///< of its pigment half-way up
  int object = 0;
};

/// The still parts of a scene: all objects but the blocks `robot`, `robot.NAME` and `moving.NAME`, and those that no
/// mirror shows. May be used by several threads at once.
class SceneGeometry {
 public:
  /// Errors: kNotFound, kRefused: `FILE:LINE: ...`, the program does not know a construct of the scene, or it is wrong.
  static Result<SceneGeometry> read(const PlaceSettings& place);

  [[nodiscard]] const std::vector<SceneObject>& objects() const;
  /// Returns the first surface that a ray meets, within `farthest_m`. The very nearest 1e-4 POV-Ray units are not
  /// looked at. @param direction of length 1
  [[nodiscard]] std::optional<SurfacePoint> cast(const WorldVector& origin, const WorldVector& direction,
                                                 double farthest_m) const;
  /// Returns the objects that have the point inside them. An infinite object, such as a plane, has an inside too; so
  /// has a box that is used as a room, whose inside is air.
  [[nodiscard]] std::vector<int> around(const WorldVector& point) const;
  [[nodiscard]] std::vector<SceneCylinder> upright_cylinders() const;
  /// Renders the scene from above, as render_overhead(), with all lights. What the height of the view cuts is dark, as
  /// in an architect's plan. The robots stand where the scene shows them.
  /// @throws std::invalid_argument as render_overhead
  [[nodiscard]] Image overhead(const OverheadView& view) const;

 private:
  struct Content;
  explicit SceneGeometry(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

  std::shared_ptr<const Content> content_;
};

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/sim_povray/render/native/ray.h"
#include "drivers/sim_povray/scene/evaluated_scene.h"
#include "hal/result.h"

namespace twocone::sim_povray {

class TracedScene;

/// The shapes of a scene of any author, for the question where a robot can stand. Lengths are in POV-Ray units and
/// points are the scene's: y is up, and world (x, y, z) is <x, z, y> * unit. The scene's robot, its block `robot` or
/// `robot.NAME`, is not part of it.
///
/// The scene is evaluated leniently (EvaluatorSettings::leniency): a pigment or a light that is not supported does no
/// harm, a shape that is not supported is replaced by a simple one around it, or left out and named.
class SceneGeometry {
 public:
  /// Errors: kNotFound, kRefused: the file cannot be read, or its text has no structure that can be evaluated.
  /// @param scene_paths folders that the scene may read, as PlaceSettings
  static Result<SceneGeometry> read(const std::filesystem::path& scene,
                                    const std::vector<std::filesystem::path>& scene_paths);
  SceneGeometry(SceneGeometry&& other) noexcept;
  SceneGeometry& operator=(SceneGeometry&& other) noexcept;
  ~SceneGeometry();

  struct Solid {
    std::string kind;               ///< POV-Ray's keyword
    std::string place;              ///< FILE:LINE of its statement
    std::optional<Bounds3> bounds;  ///< nothing: it is infinite
  };
  [[nodiscard]] const std::vector<Solid>& solids() const { return solids_; }

  struct Surface {
    Vec3 point, normal;  ///< the normal has length 1 and points to either side
    std::size_t solid;   ///< index
  };
  /// Returns the first surface that a ray meets, if its distance is within `most`. @param direction of length 1
  [[nodiscard]] std::optional<Surface> nearest(const Vec3& origin, const Vec3& direction, double most = 1e7) const;
  /// Returns whether a surface of the solid crosses the line from a to b.
  [[nodiscard]] bool crosses(std::size_t solid, const Vec3& a, const Vec3& b) const;
  /// Returns whether the point is inside of the solid by POV-Ray's rules: below a plane, for example.
  [[nodiscard]] bool contains(std::size_t solid, const Vec3& point) const;

  struct UprightCylinder {
    std::size_t solid;
    Vec3 base;  ///< the lower end of its axis
    double radius, height;
    std::optional<Colour> colour;  ///< linear; nothing: not one colour, or not understood
  };
  /// Closed cylinders with a vertical axis that are whole.
  [[nodiscard]] const std::vector<UprightCylinder>& cylinders() const { return cylinders_; }

  /// The scene's camera, the last one of its text. Nothing: it has none whose place is understood.
  [[nodiscard]] const std::optional<PerspectiveCamera>& camera() const;
  /// Return the colours that the text gives to its shapes and to its sky, as far as it is understood.
  [[nodiscard]] std::vector<Colour> colours() const;
  [[nodiscard]] std::vector<Colour> sky_colours() const;

  /// Statements that are left out and shapes that are replaced by simple ones: `FILE:LINE: why`.
  [[nodiscard]] const std::vector<std::string>& left_out() const { return left_out_; }
  [[nodiscard]] const std::vector<std::string>& bounded() const { return bounded_; }

 private:
  explicit SceneGeometry(EvaluatedScene scene);

  std::unique_ptr<const TracedScene> scene_;
  std::vector<Solid> solids_;
  std::vector<UprightCylinder> cylinders_;
  std::vector<std::string> left_out_, bounded_;
};

/// Returns the text of a scene without its robot's blocks, `robot`, `lower` and `upper` and those of further robots;
/// line numbers do not change. Empty: it names none. Errors: kNotFound, kRefused, as Scene::read.
Result<std::string> text_without_robot(const std::filesystem::path& scene);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "drivers/sim_povray/render/native/primitives.h"
#include "drivers/sim_povray/render/native/ray.h"
#include "drivers/sim_povray/scene/evaluated_scene.h"

namespace twocone::sim_povray {

/// Where a ray goes through a surface.
struct Crossing {
  double t = 0;
  Vec3 normal{};                     ///< outward of the whole solid (of an open surface: its front), not of length 1
  const Texture* texture = nullptr;  ///< of the innermost object around the surface that has one; null: none has
  bool entering = false;             ///< against the normal
};

/// An object in the form in which rays are traced against it, in the coordinates to which its `placed` leads (the
/// scene's or its mover's). Each part of a Csg and each object of `clipped_by` has a `placed` of its own that leads
/// there; that of a Csg itself is not used. May be used by several threads at once.
class TracedSolid {
 public:
  /// @param object must outlive the solid at its place: crossings point to it and to its textures
  explicit TracedSolid(const Object& object);

  /// Finds the nearest crossing with t_min < t < t_max. @returns whether there is one; `found` is else untouched
  bool nearest(const Ray& ray, double t_min, double t_max, Crossing& found) const;
  /// Returns whether there is a crossing with t_min < t < t_max.
  [[nodiscard]] bool blocks(const Ray& ray, double t_min, double t_max) const;
  [[nodiscard]] bool contains(const Vec3& point) const;
  /// Returns false if certainly none of its surfaces goes through the box.
  [[nodiscard]] bool may_cross(const Bounds3& box) const;
  /// A box around all that can be seen of it, by rounding larger than the tightest; none if it is infinite.
  [[nodiscard]] std::optional<Bounds3> bounds() const { return bounds_; }
  /// The box, if the solid is nothing but one box along the axes, neither clipped nor inverse.
  [[nodiscard]] std::optional<Bounds3> as_box() const;
  /// The texture of the first surface, as in Crossing.
  [[nodiscard]] const Texture* only_texture() const { return surfaces_.empty() ? nullptr : surfaces_.front().texture; }
  /// Returns whether it is one surface all of which is seen.
  [[nodiscard]] bool is_single() const {
    return surfaces_.size() == 1 && surfaces_.front().conditions.begin == surfaces_.front().conditions.end;
  }

 private:
  /// A place whose inside, or outside if `inverted`, is asked for.
  struct Side {
    std::size_t node;
    bool inverted;
  };
  struct Range {
    std::size_t begin = 0, end = 0;
  };
  /// An object of the tree: a primitive if `sides` is empty, else what is in all or in any of them. What `clips` leaves
  /// of it counts, also if it is inverse (measured: POV-Ray clips last, whatever the order in the text).
  struct Node {
    const Object* object;   ///< not read once the surfaces are made
    std::size_t primitive;  ///< unused if it has sides
    std::vector<Side> sides{};
    bool all = false;
    std::vector<Side> clips{};
    bool inverse = false;
  };
  /// A primitive's surface, seen where the point satisfies all of `conditions`.
  struct Surface {
    std::size_t primitive;
    Range conditions;
    const Texture* texture;
    bool inverted;
  };

  std::size_t add_node(const Object& object);
  void add_surfaces(const Side& side, const Texture* texture, std::vector<Side> conditions);
  [[nodiscard]] bool is_inside(std::size_t node, const Vec3& point) const;
  [[nodiscard]] bool is_seen(const Surface& surface, const Vec3& point) const;
  /// A box around all points of a side; none if it is infinite.
  [[nodiscard]] std::optional<Bounds3> bounds_of(const Side& side) const;
  [[nodiscard]] std::optional<Bounds3> bounds_of_surfaces() const;

  std::vector<Primitive> primitives_;
  std::vector<Surface> surfaces_;
  std::vector<Side> conditions_;
  std::vector<Node> nodes_;
  std::size_t root_ = 0;
  std::optional<Bounds3> bounds_;
};

}  // namespace twocone::sim_povray

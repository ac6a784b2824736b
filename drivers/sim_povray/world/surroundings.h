// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <variant>
#include <vector>

#include "drivers/sim_povray/place.h"

/// The stationary obstacles of a place, divided into convex parts. The distance from a convex part to a point is a
/// convex function of the point; the search for the first touch depends on this (touch.h).
namespace twocone::sim_povray {

/// Free where x_n x + y_n y > offset_m; (x_n, y_n) is a unit vector.
struct HalfPlane {
  double x_n = 0, y_n = 0;
  double offset_m = 0;
};
/// A side of an outline, from corner to corner.
struct Edge {
  FloorPoint from, to;
};

/// Distance from a part to a point (below 0 inside a disc and beyond a wall; an edge has no inside) and the unit vector
/// in that direction; the zero vector if no direction is the nearest.
struct Facing {
  double distance_m = 0;
  double x = 0, y = 0;
};
Facing facing(const HalfPlane& wall, const FloorPoint& point);
Facing facing(const Disc& disc, const FloorPoint& point);
Facing facing(const Edge& edge, const FloorPoint& point);

/// One convex part and the index of its owner.
struct Part {
  std::variant<HalfPlane, Disc, Edge> shape;
  std::size_t owner = 0;
};
inline Facing facing(const Part& part, const FloorPoint& point) {
  return std::visit([&point](const auto& shape) { return facing(shape, point); }, part.shape);
}

/// The walls and solids of a place.
class Surroundings {
 public:
  explicit Surroundings(const PlaceSettings& place);  // requires a checked place

  [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }
  /// Returns "wall", or the solid's name.
  [[nodiscard]] const std::string& name(const Part& part) const { return names_[part.owner]; }
  /// Returns the name of an outline that contains the point, however far its edges are away; nullptr: none.
  [[nodiscard]] const std::string* outline_around(const FloorPoint& point) const;

 private:
  struct NamedOutline {
    Outline outline;
    std::size_t owner;
  };
  std::vector<std::string> names_;
  std::vector<Part> parts_;
  std::vector<NamedOutline> outlines_;
};

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <variant>
#include <vector>

#include "drivers/sim_povray/sim_povray.h"

/// What stands still in a place, cut into convex parts: from a convex part the distance to a point is a convex function
/// of the point, on which the search for the first touch rests (touch.h).
namespace twocone::sim_povray {

/// Free where x_n x + y_n y > offset_m; (x_n, y_n) is a unit vector.
struct HalfPlane {
  double x_n = 0, y_n = 0;
  double offset_m = 0;
};
/// From corner to corner of an outline.
struct Edge {
  FloorPoint from, to;
};

/// From a part to a point: the distance (below 0 inside a disc and beyond a wall; an edge has no inside) and the unit
/// vector there; the zero vector where no direction is the nearest.
struct Facing {
  double distance_m = 0;
  double x = 0, y = 0;
};
Facing facing(const HalfPlane& wall, const FloorPoint& point);
Facing facing(const Disc& disc, const FloorPoint& point);
Facing facing(const Edge& edge, const FloorPoint& point);

/// One convex part and whose it is.
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
  explicit Surroundings(const PlaceSettings& place);  // taken as checked

  [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }
  /// "wall", or the solid's name.
  [[nodiscard]] const std::string& name(const Part& part) const { return names_[part.owner]; }
  /// The name of an outline that the point lies inside of, whatever its edges are away; nullptr: none.
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

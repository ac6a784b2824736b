// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene/vector3.h"

#include <numbers>

namespace twocone::sim_povray {

Transform::Half Transform::Half::then(const Half& next) const {
  return {{next.turn(rows[0]), next.turn(rows[1]), next.turn(rows[2])}, next.turn(offset) + next.offset};
}

Transform Transform::translation(const Vec3& by) {
  Transform result;
  result.forward_.offset = by;
  result.backward_.offset = -by;
  return result;
}

Transform Transform::scaling(const Vec3& by) {
  Transform result;
  result.forward_.rows = {Vec3{by.x, 0, 0}, Vec3{0, by.y, 0}, Vec3{0, 0, by.z}};
  result.backward_.rows = {Vec3{1 / by.x, 0, 0}, Vec3{0, 1 / by.y, 0}, Vec3{0, 0, 1 / by.z}};
  return result;
}

Transform Transform::rotation(const Vec3& degrees) {
  const auto turn = [](double angle_deg, std::size_t axis) {
    const double angle_rad = angle_deg * std::numbers::pi / 180;
    const double c = std::cos(angle_rad);
    const double s = std::sin(angle_rad);
    // Rows are the images of the axes; the next two axes of x, y, z turn into each other.
    const auto rows = [&](double sine) {
      switch (axis) {
        case 0:
          return std::array{Vec3{1, 0, 0}, Vec3{0, c, sine}, Vec3{0, -sine, c}};
        case 1:
          return std::array{Vec3{c, 0, -sine}, Vec3{0, 1, 0}, Vec3{sine, 0, c}};
        default:
          return std::array{Vec3{c, sine, 0}, Vec3{-sine, c, 0}, Vec3{0, 0, 1}};
      }
    };
    return Transform(Half{rows(s), {}}, Half{rows(-s), {}});
  };
  return turn(degrees.x, 0).then(turn(degrees.y, 1)).then(turn(degrees.z, 2));
}

std::optional<Transform> Transform::matrix(const std::array<Vec3, 3>& rows, const Vec3& offset) {
  const std::array<Vec3, 3> crossed{cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1])};
  const double determinant = dot(rows[0], crossed[0]);
  if (!std::isfinite(1 / determinant)) return std::nullopt;
  // The columns of the inverse are crossed[i] / determinant.
  Half back;
  back.rows = {Vec3{crossed[0].x, crossed[1].x, crossed[2].x} / determinant,
               Vec3{crossed[0].y, crossed[1].y, crossed[2].y} / determinant,
               Vec3{crossed[0].z, crossed[1].z, crossed[2].z} / determinant};
  back.offset = -back.turn(offset);
  return Transform({rows, offset}, back);
}

Transform Transform::then(const Transform& next) const {
  return {forward_.then(next.forward_), next.backward_.then(backward_)};
}

}  // namespace twocone::sim_povray

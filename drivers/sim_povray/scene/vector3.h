// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace twocone::sim_povray {

/// A point, direction or colour of a scene. Points and directions are in POV-Ray's left-handed coordinates.
struct Vec3 {
  double x = 0, y = 0, z = 0;

  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};

constexpr Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(const Vec3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
constexpr Vec3 operator*(double s, const Vec3& a) { return a * s; }
constexpr Vec3 operator/(const Vec3& a, double s) { return {a.x / s, a.y / s, a.z / s}; }
/// Component by component.
constexpr Vec3 operator*(const Vec3& a, const Vec3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
constexpr Vec3& operator+=(Vec3& a, const Vec3& b) { return a = a + b; }
constexpr double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
constexpr double greatest_component(const Vec3& a) { return std::max({a.x, a.y, a.z}); }
/// The least and the greatest of each component.
constexpr Vec3 lowest(const Vec3& a, const Vec3& b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
constexpr Vec3 highest(const Vec3& a, const Vec3& b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
inline double length(const Vec3& a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalized(const Vec3& a) { return a / length(a); }

/// An affine map p -> p.x rows[0] + p.y rows[1] + p.z rows[2] + offset, as POV-Ray's `matrix` with row vectors, and its
/// inverse.
class Transform {
 public:
  Transform() = default;
  static Transform translation(const Vec3& by);
  /// @param by each component not 0
  static Transform scaling(const Vec3& by);
  /// Rotation about x, then y, then z, by POV-Ray's left-handed rule. @param degrees per axis
  static Transform rotation(const Vec3& degrees);
  /// Nothing if the map has no inverse.
  static std::optional<Transform> matrix(const std::array<Vec3, 3>& rows, const Vec3& offset);

  /// Returns the map that applies this one first, then `next`.
  [[nodiscard]] Transform then(const Transform& next) const;
  [[nodiscard]] Transform inverse() const { return {backward_, forward_}; }

  [[nodiscard]] Vec3 point(const Vec3& p) const { return forward_.turn(p) + forward_.offset; }
  [[nodiscard]] Vec3 direction(const Vec3& d) const { return forward_.turn(d); }
  [[nodiscard]] Vec3 inverse_point(const Vec3& p) const { return backward_.turn(p) + backward_.offset; }
  [[nodiscard]] Vec3 inverse_direction(const Vec3& d) const { return backward_.turn(d); }
  /// Returns the image of a surface's normal, not of length 1.
  [[nodiscard]] Vec3 normal(const Vec3& n) const {
    return {dot(backward_.rows[0], n), dot(backward_.rows[1], n), dot(backward_.rows[2], n)};
  }
  [[nodiscard]] const std::array<Vec3, 3>& rows() const { return forward_.rows; }
  [[nodiscard]] const Vec3& offset() const { return forward_.offset; }

  friend bool operator==(const Transform&, const Transform&) = default;

 private:
  struct Half {
    std::array<Vec3, 3> rows{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    Vec3 offset{};

    [[nodiscard]] Vec3 turn(const Vec3& d) const { return rows[0] * d.x + rows[1] * d.y + rows[2] * d.z; }
    [[nodiscard]] Half then(const Half& next) const;
    friend bool operator==(const Half&, const Half&) = default;
  };
  Transform(const Half& forward, const Half& backward) : forward_(forward), backward_(backward) {}

  Half forward_;
  Half backward_;
};

}  // namespace twocone::sim_povray

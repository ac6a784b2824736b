// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <boost/multiprecision/cpp_dec_float.hpp>

namespace twocone::exact {

/// References for the tests: the same quantities in 50 decimal digits, by another formula than the library's wherever
/// there is a choice. Arguments are exactly the doubles that the library gets, so no input is rounded once more.
using Real = boost::multiprecision::number<boost::multiprecision::cpp_dec_float<50>, boost::multiprecision::et_off>;
using Vector = std::vector<Real>;
using Matrix = std::vector<Vector>;

Real pi();
/// Wraps an angle to (-pi, pi].
Real wrap(const Real& angle_rad);
/// As wrap(), with 400 digits inside, for angles of up to 1e308 rad.
double wrap_huge(double angle_rad);
Vector numbers(const std::vector<double>& values);

/// Solves by elimination with full row pivoting. @throws std::domain_error for a singular matrix
Vector solve(Matrix a, Vector b);
Matrix inverse(const Matrix& a);

/// A cone's view (vision/mirror_view.h) by its fields.
enum ViewField {
  kApex,
  kRimRadius,
  kLensToTip,
  kLensHeight,
  kCentreX,
  kCentreY,
  kRimPx,
  kAzimuth,
  kTiltX,
  kTiltY,
  kOffsetX,
  kOffsetY,
  kK1,
  kK2,
  kP1,
  kP2,
  kK3,
  kK4,
  kK5,
  kK6,
  kFocalX,
  kFocalY,
  kPrincipalX,
  kPrincipalY,
  kViewFields
};

class View {
 public:
  /// @param fields kViewFields values. The lens is left out where `distorted` is false.
  View(const Vector& fields, bool mirrored, bool distorted);

  /// Radius in the undistorted image: the *point* is mirrored in the cone's side (the library mirrors the lens).
  [[nodiscard]] Real image_radius_px(const Real& distance_m, const Real& height_m) const;
  /// Column and row. @param p x, y, z in the body frame
  [[nodiscard]] Vector project(const Vector& p) const;
  /// Origin and unit direction, by the law of reflection r = i - 2 (i.n) n in three dimensions.
  [[nodiscard]] Vector back_project(const Vector& pixel) const;
  [[nodiscard]] Real bearing_rad(const Vector& offset_px) const;
  [[nodiscard]] Vector distort(const Vector& pixel) const;

 private:
  [[nodiscard]] Vector undistort(const Vector& pixel) const;

  Vector f_;
  bool distorted_;
  Real sense_, sin_half_, cos_half_, sin_azimuth_, cos_azimuth_, rim_slope_;
  Matrix rotation_;
};

/// Slope at which the lens sees a point by a hyperbolic mirror (tests/support/hyperboloid_mirror.h): the ray from the
/// point to the upper focus is cut with the surface's quadratic.
Real hyperboloid_slope(const Real& half_axis, const Real& half_focal, const Real& distance, const Real& height);
/// Elevation of the ray that the lens sees at a slope: the lens's ray is cut with the surface and reflected about its
/// gradient.
Real hyperboloid_elevation(const Real& half_axis, const Real& half_focal, const Real& slope);

/// Inverse range 1 / (range + d), its sigma, range and its sigma. @param x disparity, sigma, v, s, d
Vector range_from_disparity(const Vector& x);

/// Pose after an arc by the textbook's form x += D / T (sin(heading + T) - sin heading), which in 50 digits has 35 left
/// at T = 1e-15. @param x wheel radius, separation, pose (x, y, heading), left and right angle before and after
Vector arc(const Vector& x);

/// The paper's triangle centre from three landmarks. Nothing where the choice of a corner depends on less than
/// `margin`.
/// @param x landmark x, y and range of each
std::optional<Vector> triangle_centre(const Vector& x, double margin);

/// The fields of one landmark's measurement for a fix.
enum MeasurementField {
  kLandmarkX,
  kLandmarkY,
  kRange,
  kBearing,
  kVarRange,
  kCovariance,
  kVarBearing,
  kMeasurementFields
};
struct Measured {
  bool range;
  bool bearing;
};
/// Maximum-likelihood pose and its covariance (row by row), by Newton's method on the gradient from a near start.
/// @param x kMeasurementFields of each landmark @param start x, y, heading; with no bearing, x and y only
class PoseProblem {
 public:
  explicit PoseProblem(std::vector<Measured> measured);
  [[nodiscard]] std::size_t unknowns() const { return unknowns_; }
  [[nodiscard]] Vector gradient(const Vector& pose, const Vector& x) const;
  [[nodiscard]] Real chi_squared(const Vector& pose, const Vector& x) const;
  /// J^T W J
  [[nodiscard]] Matrix information(const Vector& pose, const Vector& x) const;
  [[nodiscard]] Vector solve_from(Vector pose, const Vector& x) const;

 private:
  struct Row;
  [[nodiscard]] std::vector<Row> rows(const Vector& pose, const Vector& x) const;

  std::vector<Measured> measured_;
  std::size_t unknowns_;
};

/// The minimum of `cost` next to `start`, by Newton's method with differences of 1e-12: accurate to some 24 digits.
template <class Cost>
Vector minimise(const Cost& cost, Vector start, const Vector& scale, int steps);
/// Half the gradient of `cost` by the same differences.
template <class Cost>
Vector half_gradient(const Cost& cost, const Vector& at, const Vector& scale);

// --- of the templates above

template <class Cost>
Vector half_gradient(const Cost& cost, const Vector& at, const Vector& scale) {
  static const Real step("1e-12");
  Vector gradient;
  for (std::size_t i = 0; i < at.size(); ++i) {
    Vector up = at;
    Vector down = at;
    up[i] += step * scale[i];
    down[i] -= step * scale[i];
    gradient.push_back((cost(up) - cost(down)) / (4 * step * scale[i]));
  }
  return gradient;
}

template <class Cost>
Vector minimise(const Cost& cost, Vector start, const Vector& scale, int steps) {
  static const Real step("1e-12");
  for (int k = 0; k < steps; ++k) {
    const Vector gradient = half_gradient(cost, start, scale);
    Matrix hessian(start.size(), Vector(start.size()));
    for (std::size_t i = 0; i < start.size(); ++i) {
      Vector up = start;
      Vector down = start;
      up[i] += step * scale[i];
      down[i] -= step * scale[i];
      const Vector above = half_gradient(cost, up, scale);
      const Vector below = half_gradient(cost, down, scale);
      for (std::size_t j = 0; j < start.size(); ++j) hessian[j][i] = (above[j] - below[j]) / (2 * step * scale[i]);
    }
    const Vector move = solve(hessian, gradient);
    for (std::size_t i = 0; i < start.size(); ++i) start[i] -= move[i];
  }
  return start;
}

}  // namespace twocone::exact

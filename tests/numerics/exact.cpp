// SPDX-License-Identifier: Apache-2.0
#include "tests/numerics/exact.h"

#include <stdexcept>
#include <utility>

#include <boost/math/constants/constants.hpp>

namespace twocone::exact {
namespace {

template <class T>
T wrapped(const T& angle, const T& half_turn) {
  const T turns = ceil((angle - half_turn) / (2 * half_turn));  // (-pi, pi] needs none
  return angle - turns * 2 * half_turn;
}

Real square(const Real& x) { return x * x; }

Vector rotate(const Matrix& r, const Vector& v, bool back) {
  Vector out(3);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) out[i] += (back ? r[j][i] : r[i][j]) * v[j];
  }
  return out;
}

Real dot(const Vector& a, const Vector& b) {
  Real sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

Real pi() {
  static const Real value = boost::math::constants::pi<Real>();
  return value;
}

Real wrap(const Real& angle_rad) { return wrapped(angle_rad, pi()); }

double wrap_huge(double angle_rad) {
  using Wide = boost::multiprecision::number<boost::multiprecision::cpp_dec_float<400>, boost::multiprecision::et_off>;
  static const Wide half_turn = 2 * asin(Wide(1));
  return static_cast<double>(wrapped(Wide(angle_rad), half_turn));
}

Vector numbers(const std::vector<double>& values) { return {values.begin(), values.end()}; }

Vector solve(Matrix a, Vector b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t best = k;
    for (std::size_t i = k + 1; i < n; ++i) {
      if (abs(a[i][k]) > abs(a[best][k])) best = i;
    }
    if (a[best][k] == 0) throw std::domain_error("exact::solve: singular");
    std::swap(a[k], a[best]);
    std::swap(b[k], b[best]);
    for (std::size_t i = k + 1; i < n; ++i) {
      const Real factor = a[i][k] / a[k][k];
      for (std::size_t j = k; j < n; ++j) a[i][j] -= factor * a[k][j];
      b[i] -= factor * b[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) b[k] -= a[k][j] * b[j];
    b[k] /= a[k][k];
  }
  return b;
}

Matrix inverse(const Matrix& a) {
  const std::size_t n = a.size();
  Matrix out(n, Vector(n));
  for (std::size_t j = 0; j < n; ++j) {
    Vector unit(n);
    unit[j] = 1;
    const Vector column = solve(a, unit);
    for (std::size_t i = 0; i < n; ++i) out[i][j] = column[i];
  }
  return out;
}

View::View(const Vector& fields, bool mirrored, bool distorted)
    : f_(fields),
      distorted_(distorted),
      sense_(mirrored ? -1 : 1),
      sin_half_(sin(f_[kApex] / 2)),
      cos_half_(cos(f_[kApex] / 2)),
      sin_azimuth_(sin(f_[kAzimuth])),
      cos_azimuth_(cos(f_[kAzimuth])),
      rim_slope_(f_[kRimRadius] / (f_[kLensToTip] + f_[kRimRadius] * cos_half_ / sin_half_)) {
  const Real sx = sin(f_[kTiltX]);
  const Real cx = cos(f_[kTiltX]);
  const Real sy = sin(f_[kTiltY]);
  const Real cy = cos(f_[kTiltY]);
  rotation_ = {{cy, sy * sx, sy * cx}, {0, cx, -sx}, {-sy, cy * sx, cy * cx}};  // R_y R_x
}

Real View::image_radius_px(const Real& distance_m, const Real& height_m) const {
  const Real out = distance_m;
  const Real up = height_m - f_[kLensHeight] - f_[kLensToTip];  // above the tip
  const Real along = out * sin_half_ + up * cos_half_;
  const Real mirrored_out = 2 * along * sin_half_ - out;
  const Real mirrored_up = 2 * along * cos_half_ - up + f_[kLensToTip];  // above the lens
  return f_[kRimPx] * mirrored_out / mirrored_up / rim_slope_;
}

Vector View::project(const Vector& p) const {
  const Vector unit = rotate(rotation_, {p[0] - f_[kOffsetX], p[1] - f_[kOffsetY], p[2] - f_[kLensHeight]}, true);
  const Real distance = sqrt(square(unit[0]) + square(unit[1]));
  const Real radius = image_radius_px(distance, unit[2] + f_[kLensHeight]);
  const Real c = unit[0] / distance;
  const Real s = unit[1] / distance;
  const Vector pixel = {f_[kCentreX] + radius * (c * cos_azimuth_ + s * sin_azimuth_),
                        f_[kCentreY] + sense_ * radius * (s * cos_azimuth_ - c * sin_azimuth_)};
  return distorted_ ? distort(pixel) : pixel;
}

Vector View::distort(const Vector& pixel) const {
  const Real x = (pixel[0] - f_[kPrincipalX]) / f_[kFocalX];
  const Real y = (pixel[1] - f_[kPrincipalY]) / f_[kFocalY];
  const Real r2 = x * x + y * y;
  const Real r4 = r2 * r2;
  const Real r6 = r4 * r2;
  const Real scale =
      (1 + f_[kK1] * r2 + f_[kK2] * r4 + f_[kK3] * r6) / (1 + f_[kK4] * r2 + f_[kK5] * r4 + f_[kK6] * r6);
  return {f_[kPrincipalX] + f_[kFocalX] * (x * scale + 2 * f_[kP1] * x * y + f_[kP2] * (r2 + 2 * x * x)),
          f_[kPrincipalY] + f_[kFocalY] * (y * scale + f_[kP1] * (r2 + 2 * y * y) + 2 * f_[kP2] * x * y)};
}

Vector View::undistort(const Vector& pixel) const {
  // Newton's method from the pixel itself, with differences for the Jacobian: the error is squared down to the
  // differences' 1e-24, then shrinks by that factor per step.
  static const Real step("1e-12");
  Vector at = pixel;
  for (int i = 0; i < 9; ++i) {
    const Vector here = distort(at);
    Matrix jacobian(2, Vector(2));
    for (std::size_t j = 0; j < 2; ++j) {
      Vector up = at;
      Vector down = at;
      up[j] += step;
      down[j] -= step;
      const Vector above = distort(up);
      const Vector below = distort(down);
      for (std::size_t k = 0; k < 2; ++k) jacobian[k][j] = (above[k] - below[k]) / (2 * step);
    }
    const Vector move = solve(jacobian, {pixel[0] - here[0], pixel[1] - here[1]});
    at[0] += move[0];
    at[1] += move[1];
  }
  return at;
}

Real View::bearing_rad(const Vector& offset_px) const {
  return wrap(f_[kAzimuth] + sense_ * atan2(offset_px[1], offset_px[0]));
}

Vector View::back_project(const Vector& pixel) const {
  const Vector plain = distorted_ ? undistort(pixel) : pixel;
  const Real column = plain[0] - f_[kCentreX];
  const Real row = sense_ * (plain[1] - f_[kCentreY]);
  const Real radius = sqrt(square(column) + square(row));
  const Real c = (column * cos_azimuth_ - row * sin_azimuth_) / radius;
  const Real s = (row * cos_azimuth_ + column * sin_azimuth_) / radius;
  const Real slope = radius * rim_slope_ / f_[kRimPx];
  const Vector incoming = {slope * c, slope * s, 1};
  // On the cone's side, distance = (height - d) tan(half).
  const Real up = f_[kLensToTip] * sin_half_ / (sin_half_ - slope * cos_half_);
  const Vector hit = {slope * up * c, slope * up * s, up};
  const Vector normal = {cos_half_ * c, cos_half_ * s, -sin_half_};
  const Real twice = 2 * dot(incoming, normal);
  Vector outgoing(3);
  for (std::size_t i = 0; i < 3; ++i) outgoing[i] = incoming[i] - twice * normal[i];
  const Real length = sqrt(dot(outgoing, outgoing));
  Vector ray = rotate(rotation_, hit, false);
  ray[0] += f_[kOffsetX];
  ray[1] += f_[kOffsetY];
  ray[2] += f_[kLensHeight];
  for (const Real& d : rotate(rotation_, outgoing, false)) ray.push_back(d / length);
  return ray;
}

Real hyperboloid_slope(const Real& half_axis, const Real& half_focal, const Real& distance, const Real& height) {
  // For points F + t u with u = (distance, height - 2 c): (y / a)^2 - (r / b)^2 = 1 about the middle between the foci.
  const Real a2 = square(half_axis);
  const Real b2 = square(half_focal) - a2;
  const Real up = height - 2 * half_focal;
  const Real squared = square(up) / a2 - square(distance) / b2;
  const Real linear = half_focal * up / a2;  // halved
  const Real constant = square(half_focal) / a2 - 1;
  const Real root = sqrt(square(linear) - squared * constant);
  // Among the crossings with both sheets in both directions, take the nearest one before the point on the upper sheet.
  std::optional<Real> best;
  for (const Real& t : squared == 0 ? Vector{-constant / (2 * linear)}
                                    : Vector{(-linear - root) / squared, (-linear + root) / squared}) {
    if (t > 0 && half_focal + t * up > 0 && (!best || t < *best)) best = t;
  }
  if (!best) throw std::domain_error("exact::hyperboloid_slope: no crossing");
  return *best * distance / (2 * half_focal + *best * up);
}

Real hyperboloid_elevation(const Real& half_axis, const Real& half_focal, const Real& slope) {
  // For heights z on the lens's ray (slope z, z): (z - c)^2 / a^2 - slope^2 z^2 / b^2 = 1.
  const Real a2 = square(half_axis);
  const Real b2 = square(half_focal) - a2;
  const Real squared = 1 / a2 - square(slope) / b2;
  const Real linear = -half_focal / a2;  // halved
  const Real constant = square(half_focal) / a2 - 1;
  const Real z = (-linear + sqrt(square(linear) - squared * constant)) / squared;  // the upper sheet is farther
  const Vector incoming = {slope, 1};
  const Vector normal = {-slope * z / b2, (z - half_focal) / a2};
  const Real twice = 2 * dot(incoming, normal) / dot(normal, normal);
  return atan2(incoming[1] - twice * normal[1], incoming[0] - twice * normal[0]);
}

Vector range_from_disparity(const Vector& x) {
  const Real scale = x[2] * x[3];
  return {x[0] / scale, x[1] / scale, scale / x[0] - x[4], scale * x[1] / square(x[0])};
}

Vector arc(const Vector& x) {
  const Real left = x[0] * (x[7] - x[5]);
  const Real right = x[0] * (x[8] - x[6]);
  const Real way = (left + right) / 2;
  const Real turn = (right - left) / x[1];
  const Real& heading = x[4];
  if (turn == 0) return {x[2] + way * cos(heading), x[3] + way * sin(heading), wrap(heading)};
  return {x[2] + way / turn * (sin(heading + turn) - sin(heading)),
          x[3] - way / turn * (cos(heading + turn) - cos(heading)), wrap(heading + turn)};
}

std::optional<Vector> triangle_centre(const Vector& x, double margin) {
  Vector centre(2);
  const auto at = [&x](std::size_t i) { return Vector{x[3 * i], x[3 * i + 1]}; };
  for (const auto& [a, b, third] : {std::array{0, 1, 2}, std::array{0, 2, 1}, std::array{1, 2, 0}}) {
    const Vector p = at(std::size_t(a));
    const Vector q = at(std::size_t(b));
    const Vector l = at(std::size_t(third));
    const Real& r = x[3 * std::size_t(a) + 2];
    const Real& s = x[3 * std::size_t(b) + 2];
    const Real dx = q[0] - p[0];
    const Real dy = q[1] - p[1];
    const Real d2 = dx * dx + dy * dy;
    // The textbook's law of cosines: r cos = (d^2 + r^2 - s^2) / (2 d).
    const Real part = (d2 + r * r - s * s) / (2 * d2);
    const Real high2 = r * r / d2 - part * part;
    if (high2 < margin) return std::nullopt;
    const Real high = sqrt(high2);
    std::array<Vector, 2> meets;
    std::array<Real, 2> misses;
    for (std::size_t k = 0; k < 2; ++k) {
      const Real h = k == 0 ? high : -high;
      meets[k] = {p[0] + part * dx - h * dy, p[1] + part * dy + h * dx};
      misses[k] = abs(sqrt(square(meets[k][0] - l[0]) + square(meets[k][1] - l[1])) - x[3 * std::size_t(third) + 2]);
    }
    if (abs(misses[0] - misses[1]) < margin * sqrt(d2)) return std::nullopt;
    const Vector& corner = misses[0] < misses[1] ? meets[0] : meets[1];
    centre[0] += corner[0] / 3;
    centre[1] += corner[1] / 3;
  }
  return centre;
}

/// A residual with its derivative by the pose, both already whitened.
struct PoseProblem::Row {
  Real residual;
  Vector slope;
};

PoseProblem::PoseProblem(std::vector<Measured> measured) : measured_(std::move(measured)), unknowns_(2) {
  for (const Measured& m : measured_) unknowns_ = m.bearing ? 3 : unknowns_;
}

std::vector<PoseProblem::Row> PoseProblem::rows(const Vector& pose, const Vector& x) const {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < measured_.size(); ++i) {
    const Real* const m = &x[i * kMeasurementFields];
    const Real dx = m[kLandmarkX] - pose[0];
    const Real dy = m[kLandmarkY] - pose[1];
    const Real r2 = dx * dx + dy * dy;
    const Real r = sqrt(r2);
    const auto resized = [this](Vector v) {
      v.resize(unknowns_);
      return v;
    };
    Row range{m[kRange] - r, resized({dx / r, dy / r, 0})};
    Row bearing{0, resized({-dy / r2, dx / r2, 1})};
    if (measured_[i].bearing) bearing.residual = wrap(m[kBearing] - atan2(dy, dx) + pose[2]);
    const auto scale = [](Row& row, const Real& by) {
      row.residual *= by;
      for (Real& s : row.slope) s *= by;
    };
    if (measured_[i].range && measured_[i].bearing) {
      // W = C^-1 = K^T K with K = [[1/s1, 0], [-rho/(s1 q), 1/q]], q^2 = var_bearing - covariance^2 / var_range.
      const Real s1 = sqrt(m[kVarRange]);
      const Real q = sqrt(m[kVarBearing] - m[kCovariance] * m[kCovariance] / m[kVarRange]);
      const Real along = m[kCovariance] / m[kVarRange];
      bearing.residual -= along * range.residual;
      for (std::size_t k = 0; k < unknowns_; ++k) bearing.slope[k] -= along * range.slope[k];
      scale(range, 1 / s1);
      scale(bearing, 1 / q);
      rows.push_back(range);
      rows.push_back(bearing);
    } else if (measured_[i].range) {
      scale(range, 1 / sqrt(m[kVarRange]));
      rows.push_back(range);
    } else if (measured_[i].bearing) {
      scale(bearing, 1 / sqrt(m[kVarBearing]));
      rows.push_back(bearing);
    }
  }
  return rows;
}

Vector PoseProblem::gradient(const Vector& pose, const Vector& x) const {
  Vector g(unknowns_);
  for (const Row& row : rows(pose, x)) {
    for (std::size_t k = 0; k < unknowns_; ++k) g[k] += row.slope[k] * row.residual;
  }
  return g;
}

Real PoseProblem::chi_squared(const Vector& pose, const Vector& x) const {
  Real sum = 0;
  for (const Row& row : rows(pose, x)) sum += square(row.residual);
  return sum;
}

Matrix PoseProblem::information(const Vector& pose, const Vector& x) const {
  Matrix a(unknowns_, Vector(unknowns_));
  for (const Row& row : rows(pose, x)) {
    for (std::size_t i = 0; i < unknowns_; ++i) {
      for (std::size_t j = 0; j < unknowns_; ++j) a[i][j] += row.slope[i] * row.slope[j];
    }
  }
  return a;
}

Vector PoseProblem::solve_from(Vector pose, const Vector& x) const {
  static const Real step("1e-18");
  static const Real done("1e-40");
  for (int iteration = 0; iteration < 30; ++iteration) {
    Matrix hessian(unknowns_, Vector(unknowns_));
    for (std::size_t i = 0; i < unknowns_; ++i) {
      Vector up = pose;
      Vector down = pose;
      up[i] += step;
      down[i] -= step;
      const Vector above = gradient(up, x);
      const Vector below = gradient(down, x);
      for (std::size_t j = 0; j < unknowns_; ++j) hessian[j][i] = (above[j] - below[j]) / (2 * step);
    }
    const Vector move = solve(hessian, gradient(pose, x));
    Real most = 0;
    for (std::size_t i = 0; i < unknowns_; ++i) {
      pose[i] -= move[i];
      most = most < abs(move[i]) ? Real(abs(move[i])) : most;
    }
    if (most < done) return pose;
  }
  throw std::domain_error("exact::PoseProblem: Newton's method does not end");
}

}  // namespace twocone::exact

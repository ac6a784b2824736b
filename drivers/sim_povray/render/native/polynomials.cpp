// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/sim_povray/render/native/ray.h"

namespace twocone::sim_povray {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

/// s^N + coefficients[N-1] s^(N-1) + ... + coefficients[0]
template <std::size_t N>
struct Monic {
  std::array<double, N> coefficients;

  /// Returns the value and the derivative.
  [[nodiscard]] std::pair<double, double> at(double s) const {
    double value = 1, slope = 0;
    for (std::size_t i = N; i-- > 0;) {
      slope = slope * s + value;
      value = value * s + coefficients[i];
    }
    return {value, slope};
  }
};

/// Returns the root in [low, high], where the values at the ends have different signs: Newton's steps, and halves where
/// a step would leave what is left of the interval.
template <std::size_t N>
double root_between(const Monic<N>& polynomial, double low, double high, bool rises) {
  // Halving alone ends after 53 + log2(range / smallest gap) steps; Newton's after far fewer.
  constexpr int kMostSteps = 100;
  double s = (low + high) / 2;
  for (int step = 0; step < kMostSteps; ++step) {
    const auto [value, slope] = polynomial.at(s);
    if (value == 0) return s;
    ((value < 0) == rises ? low : high) = s;
    double next = s - value / slope;  // an infinity or NaN of slope 0 fails the comparison below
    if (!(next > low && next < high)) next = (low + high) / 2;
    // Two units in the last place: the value of s cannot be told more exactly.
    if (std::abs(next - s) <= 2 * kEpsilon * std::abs(s) || next == low || next == high) return next;
    s = next;
  }
  return s;
}

/// Appends the roots between each two neighbours of `breaks`, between which the polynomial is monotonic.
/// @returns the number of roots
template <std::size_t N, std::size_t Breaks>
std::size_t roots_between(const Monic<N>& polynomial, const std::array<double, Breaks>& breaks, std::size_t break_count,
                          double* roots) {
  std::size_t count = 0;
  bool was_negative = polynomial.at(breaks[0]).first < 0;
  for (std::size_t i = 1; i < break_count; ++i) {
    const bool is_negative = polynomial.at(breaks[i]).first < 0;
    if (is_negative != was_negative) {
      roots[count++] = root_between(polynomial, breaks[i - 1], breaks[i], was_negative);
      was_negative = is_negative;
    }
  }
  return count;
}

}  // namespace

Roots solve_quadratic(double a, double b, double c) {
  // b^2 - a c by Kahan: the fused multiply-add keeps what the product a c lost, so that tangents are told apart from
  // misses although the difference cancels.
  const double product = a * c;
  const double discriminant = std::fma(b, b, -product) + std::fma(-a, c, product);
  if (!(discriminant >= 0)) return {};
  // The sum of two numbers of one sign does not cancel; the other root follows from the product c / a of the two.
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  if (q == 0) return a == 0 ? Roots{} : Roots{2, 0, 0};
  if (a == 0) return {1, c / q, c / q};
  const auto [low, high] = std::minmax({q / a, c / q});
  return {2, low, high};
}

TorusCrossings cross_torus(const Vec3& nearest, const Vec3& direction, double major_radius, double minor_radius) {
  const Vec3& p = nearest;
  const Vec3& d = direction;
  const double distance_squared = dot(p, p);
  const double reach = major_radius + minor_radius;
  if (distance_squared > reach * reach) return {};

  // All crossings lie within the sphere that encloses the torus, and between the planes that touch it. A margin makes
  // the ends lie outside of the torus by more than rounding.
  constexpr double kMargin = 1.001;
  double high = std::sqrt(std::max(0.0, kMargin * kMargin * reach * reach - distance_squared));
  double low = -high;
  const double half_height = kMargin * minor_radius;
  if (d.y == 0) {
    if (std::abs(p.y) > minor_radius) return {};
  } else {
    const double at_bottom = (-half_height - p.y) / d.y;
    const double at_top = (half_height - p.y) / d.y;
    low = std::max(low, std::min(at_bottom, at_top));
    high = std::min(high, std::max(at_bottom, at_top));
    if (low >= high) return {};
  }

  // (|x|^2 + R^2 - r^2)^2 - 4 R^2 (x.x^2 + x.z^2) at x = p + s d, where |x|^2 = |p|^2 + s^2 because p is at right
  // angles to d: there is no cubic term, and the coefficients are of the torus's size however far the eye is. The
  // constant is a product whose first factor would cancel near the surface if it were a difference of squares.
  const double across = std::hypot(p.x, p.z);
  const double outward = across - major_radius;
  const double first_factor = p.y * p.y + (outward - minor_radius) * (outward + minor_radius);
  const double second_factor = first_factor + 4 * major_radius * across;
  const double middle = distance_squared + (major_radius - minor_radius) * reach;
  const double square = 2 * middle - 4 * major_radius * major_radius * (d.x * d.x + d.z * d.z);
  const double linear = 8 * major_radius * major_radius * p.y * d.y;  // p.x d.x + p.z d.z = -p.y d.y
  const Monic<4> quartic{{first_factor * second_factor, linear, square, 0}};
  const Monic<3> quarter_of_derivative{{linear / 4, square / 2, 0}};

  // Between the roots of the derivative the quartic is monotonic; between those of the second derivative the first is.
  std::array<double, 4> cubic_breaks{low, high};
  std::size_t cubic_break_count = 2;
  if (square < 0) {
    const double turn = std::sqrt(-square / 6);
    cubic_breaks = {low, std::clamp(-turn, low, high), std::clamp(turn, low, high), high};
    cubic_break_count = 4;
  }
  std::array<double, 5> breaks{low};
  const std::size_t turns = roots_between(quarter_of_derivative, cubic_breaks, cubic_break_count, breaks.data() + 1);
  breaks[turns + 1] = high;
  TorusCrossings found;
  found.count = static_cast<int>(roots_between(quartic, breaks, turns + 2, found.at));

  // One step of Newton's on (rho - R)^2 + y^2 - r^2, whose rounding is that of the tube and not of the whole torus. Not
  // for a torus that meets itself: its inner surface has another equation. Not where the line grazes: there the
  // slope says nothing.
  if (minor_radius >= major_radius) return found;
  for (int i = 0; i < found.count; ++i) {
    const double s = found.at[i];
    const Vec3 x = p + d * s;
    const double rho = std::hypot(x.x, x.z);
    const double from_ring = rho - major_radius;
    const double value = x.y * x.y + (from_ring - minor_radius) * (from_ring + minor_radius);
    const double slope = 2 * (from_ring * (x.x * d.x + x.z * d.z) / rho + x.y * d.y);
    constexpr double kGrazing = 1e-3;
    if (std::abs(slope) > kGrazing * minor_radius) found.at[i] = s - value / slope;
  }
  return found;
}

}  // namespace twocone::sim_povray

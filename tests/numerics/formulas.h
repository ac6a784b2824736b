// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/QR>

namespace twocone::formulas {

/// The textbook's formulas and ours in any floating-point type. Ours are transcribed from vision/ and localisation/,
/// which are in double only. Where a figure shows "ours, double", the library itself is called if it has such a
/// function.

/// Half the chord of two circles (a, b: radii) whose centres are `distance` apart, by the law of cosines.
template <class T>
T half_chord_textbook(T distance, T a, T b) {
  const T reach = (distance * distance + a * a - b * b) / (2 * distance);
  return std::sqrt(a * a - reach * reach);
}

/// The same by Kahan's form of Heron's formula (localisation/paper_trilateration.cpp).
template <class T>
T half_chord_ours(T distance, T a, T b) {
  std::array<T, 3> s{distance, a, b};
  std::sort(s.begin(), s.end(), std::greater<>());
  const T closing = s[2] - (s[0] - s[1]);
  if (std::abs(closing) <= 4 * std::numeric_limits<T>::epsilon() * s[0]) return 0;
  const T area = std::sqrt((s[0] + (s[1] + s[2])) * closing * (s[2] + (s[0] - s[1])) * (s[0] + (s[1] - s[2]))) / 4;
  return 2 * area / distance;
}

template <class T>
using Point = Eigen::Matrix<T, 2, 1>;

template <class T>
struct Range {
  Point<T> landmark;
  T range;
};

/// Subtracts circle 1's equation from the others', which is linear in the position.
template <class T>
Point<T> trilaterate_textbook(const std::array<Range<T>, 3>& m) {
  Eigen::Matrix<T, 2, 2> a;
  Point<T> b;
  for (int i = 0; i < 2; ++i) {
    const Range<T>& one = m[std::size_t(i) + 1];
    a.row(i) = 2 * (one.landmark - m[0].landmark).transpose();
    b[i] = one.landmark.squaredNorm() - m[0].landmark.squaredNorm() - one.range * one.range + m[0].range * m[0].range;
  }
  const T determinant = a(0, 0) * a(1, 1) - a(0, 1) * a(1, 0);
  return {(b[0] * a(1, 1) - a(0, 1) * b[1]) / determinant, (a(0, 0) * b[1] - b[0] * a(1, 0)) / determinant};
}

/// The triangle's centre relative to the first landmark, for circles that cross (localisation/paper_trilateration.cpp).
template <class T>
Point<T> trilaterate_ours(const std::array<Range<T>, 3>& m) {
  const Point<T> origin = m[0].landmark;
  Point<T> sum = Point<T>::Zero();
  for (const auto& [a, b, third] : {std::array{0, 1, 2}, std::array{0, 2, 1}, std::array{1, 2, 0}}) {
    const Range<T>& p = m[std::size_t(a)];
    const Range<T>& q = m[std::size_t(b)];
    const Range<T>& l = m[std::size_t(third)];
    const Point<T> between = (q.landmark - origin) - (p.landmark - origin);
    const T distance = std::hypot(between.x(), between.y());
    const Point<T> along = between / distance;
    const T reach = (distance + (p.range - q.range) * ((p.range + q.range) / distance)) / 2;
    const T height = half_chord_ours(distance, p.range, q.range);
    const Point<T> foot = (p.landmark - origin) + along * reach;
    const Point<T> across(-along.y() * height, along.x() * height);
    const auto miss = [&](const Point<T>& x) { return std::abs((x - (l.landmark - origin)).norm() - l.range); };
    sum += miss(foot + across) <= miss(foot - across) ? Point<T>(foot + across) : Point<T>(foot - across);
  }
  return origin + sum / 3;
}

template <class T>
struct Place {
  T x, y;
};

/// An arc of length `way` and angle `turn` from the origin: speed over turn rate.
template <class T>
Place<T> arc_textbook(T way, T turn, T heading) {
  const T radius = way / turn;
  return {radius * (std::sin(heading + turn) - std::sin(heading)),
          -radius * (std::cos(heading + turn) - std::cos(heading))};
}

/// The same by the arc's chord (localisation/odometry.cpp).
template <class T>
Place<T> arc_ours(T way, T turn, T heading) {
  const T half = turn / 2;
  const T chord = way * (half == 0 ? T(1) : std::sin(half) / half);
  return {chord * std::cos(heading + half), chord * std::sin(heading + half)};
}

template <class T, int rows>
using Rows = Eigen::Matrix<T, rows, 2>;
template <class T, int rows>
using Column = Eigen::Matrix<T, rows, 1>;

/// (J^T W J)^-1 J^T W e.
template <class T, int rows>
Point<T> step_textbook(const Rows<T, rows>& j, const Column<T, rows>& e, const Column<T, rows>& sigma) {
  const Column<T, rows> weight = sigma.cwiseProduct(sigma).cwiseInverse();
  const Eigen::Matrix<T, 2, 2> a = j.transpose() * weight.asDiagonal() * j;
  const Point<T> b = j.transpose() * weight.cwiseProduct(e);
  return a.ldlt().solve(b);
}

/// QR of the rows divided by their sigmas, the most accurate first (localisation/least_squares).
template <class T, int rows>
Point<T> step_ours(const Rows<T, rows>& j, const Column<T, rows>& e, const Column<T, rows>& sigma) {
  std::array<int, std::size_t(rows)> order;
  for (int i = 0; i < rows; ++i) order[std::size_t(i)] = i;
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return sigma[a] < sigma[b]; });
  Rows<T, rows> whitened;
  Column<T, rows> right;
  for (int i = 0; i < rows; ++i) {
    const int from = order[std::size_t(i)];
    whitened.row(i) = j.row(from) / sigma[from];
    right[i] = e[from] / sigma[from];
  }
  return whitened.householderQr().solve(right);
}

template <class T>
T angle_textbook(const Point<T>& u, const Point<T>& v) {
  return std::acos(u.dot(v) / (u.norm() * v.norm()));
}

template <class T>
T angle_ours(const Point<T>& u, const Point<T>& v) {
  return std::abs(std::atan2(u.x() * v.y() - u.y() * v.x(), u.dot(v)));
}

}  // namespace twocone::formulas

// SPDX-License-Identifier: Apache-2.0
#include "localisation/least_squares/starts.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>

namespace twocone::localisation::least_squares {
namespace {

void add_ranged(const Problem& problem, Starts& starts) {
  // Var(r^2) = 4 r^2 sigma^2 + 2 sigma^4.
  const auto weight = [](const Landmark& l) {
    const double variance = square(1 / l.range_weight);
    return 1 / (4 * square(l.range) * variance + 2 * square(variance) + square(kEps));
  };
  double sum = 0;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_range) continue;
    const double w = weight(l);
    sum += w;
    middle += w * l.place();
  }
  middle /= sum;
  // Relative to the weighted mean: r^2 = |l|^2 - 2 l.p + |p|^2, with sum w l = 0.
  double xx = 0;
  double xy = 0;
  double yy = 0;
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  double mean_square = 0;
  double widest = 0;
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_range) continue;
    const double w = weight(l) / sum;
    const Eigen::Vector2d p = l.place() - middle;
    const double distance = std::hypot(p.x(), p.y());
    const double f = (l.range - distance) * (l.range + distance);
    const Eigen::Vector2d weighted = w * p;
    xx += weighted.x() * p.x();
    xy += weighted.x() * p.y();
    yy += weighted.y() * p.y();
    b -= weighted * f / 2;
    mean_square += w * f;
    widest = std::max(widest, std::sqrt(l.range / l.range_weight));
  }
  const double axis = std::atan2(2 * xy, xx - yy) / 2;
  const double ax = std::cos(axis);
  const double ay = std::sin(axis);
  const double major = xx * ax * ax + 2 * xy * ax * ay + yy * ay * ay;
  const double minor = std::max(0.0, xx * ay * ay - 2 * xy * ax * ay + yy * ax * ax);
  if (!(major > 0)) return;
  const double along = (b.x() * ax + b.y() * ay) / major;
  const auto add = [&](double across) {
    starts.add(with_heading(problem, middle.x() + along * ax - across * ay, middle.y() + along * ay + across * ax));
  };
  // Nearer to the axis than sqrt(2 r sigma) the ranges do not determine the side; on the axis itself the cost has no
  // slope to leave it.
  const double height = std::max(std::sqrt(std::max(0.0, mean_square - along * along)), widest);
  add(height);
  add(-height);
  if (minor > kEps * major) add((b.y() * ax - b.x() * ay) / minor);
}

void add_resection(const Problem& problem, Starts& starts) {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_bearing) continue;
    const double c = l.cos_bearing;
    const double s = l.sin_bearing;
    const Eigen::Vector4d row(c * l.y - s * l.x, -c * l.x - s * l.y, -s, c);
    normal += square(std::min(l.bearing_weight, 1 / std::sqrt(kEps))) * row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(normal);
  // Use the second eigenvector too. Near the circle through three landmarks there is a plane of null vectors: take
  // directions all round it.
  constexpr double kPlane = 1e-6;  // share of the largest eigenvalue: within a thousandth of the circle's size
  const bool is_plane = eigen.eigenvalues()[1] <= kPlane * eigen.eigenvalues()[3];
  starts.is_one_valley = is_plane;
  const int count = is_plane ? 8 : 2;
  for (int k = 0; k < count; ++k) {
    const double mix = std::numbers::pi * k / count;
    Eigen::Vector4d v = std::cos(mix) * eigen.eigenvectors().col(0) + std::sin(mix) * eigen.eigenvectors().col(1);
    const double turn = std::hypot(v[0], v[1]);
    if (turn < 1e-9) continue;
    v /= turn;
    int ahead = 0;
    for (const Landmark& l : problem.landmarks) {
      if (!l.has_bearing) continue;
      const double forward =
          l.cos_bearing * (v[0] * l.x + v[1] * l.y + v[2]) + l.sin_bearing * (v[0] * l.y - v[1] * l.x + v[3]);
      ahead += forward > 0 ? 1 : -1;
    }
    if (ahead < 0) v = -v;  // the bearings point at the landmarks, not away from them
    starts.add({-(v[0] * v[2] - v[1] * v[3]), -(v[1] * v[2] + v[0] * v[3]), std::atan2(v[1], v[0])});
  }
}

}  // namespace

State with_heading(const Problem& problem, double x, double y) {
  double c = 0;
  double s = 0;
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_bearing) continue;
    const double dx = l.x - x;
    const double dy = l.y - y;
    const double distance = std::hypot(dx, dy);
    if (distance == 0) continue;
    const double w = l.bearing_weight / distance;
    c += w * (dx * l.cos_bearing + dy * l.sin_bearing);
    s += w * (dy * l.cos_bearing - dx * l.sin_bearing);
  }
  return {x, y, problem.has_heading ? std::atan2(s, c) : 0};
}

Alignment align(const Problem& problem) {
  const auto weight = [](const Landmark& l) {
    return 1 / (square(1 / l.range_weight) + square(l.range * l.sigma_bearing_rad));
  };
  double sum = 0;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  Eigen::Vector2d seen = Eigen::Vector2d::Zero();
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_range || !l.has_bearing) continue;
    const double w = weight(l);
    sum += w;
    place += w * l.place();
    seen += w * l.range * Eigen::Vector2d(l.cos_bearing, l.sin_bearing);
  }
  place /= sum;
  seen /= sum;
  double c = 0;
  double s = 0;
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_range || !l.has_bearing) continue;
    const double w = weight(l);
    const Eigen::Vector2d a = l.range * Eigen::Vector2d(l.cos_bearing, l.sin_bearing) - seen;
    const Eigen::Vector2d b = l.place() - place;
    c += w * a.dot(b);
    s += w * (a.x() * b.y() - a.y() * b.x());
  }
  Alignment a;
  a.strength = std::hypot(c, s);
  const double heading_rad = std::atan2(s, c);
  c = std::cos(heading_rad);
  s = std::sin(heading_rad);
  a.state = {place.x() - (c * seen.x() - s * seen.y()), place.y() - (s * seen.x() + c * seen.y()), heading_rad};
  return a;
}

void add_starts(const Problem& problem, Starts& starts) {
  if (problem.places.ranged >= 2) add_ranged(problem, starts);
  if (problem.places.bearing >= 3) add_resection(problem, starts);
}

}  // namespace twocone::localisation::least_squares

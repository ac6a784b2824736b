// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "vision/calibration/shared.h"

/// MirrorView::project and near_top_point for a number type that carries derivatives. One difference: the formulas
/// continue smoothly beyond the rim, where MirrorView has no answer. A test checks that both agree.
namespace twocone::vision::calibration {

template <typename T>
struct ViewNumbers {
  T column, row, rim_px, azimuth, tilt_x, tilt_y, offset_x, offset_y, apex, mirror_radius, lens_to_tip, k1, k2,
      lens_height;
};

template <typename T>
ViewNumbers<T> view_numbers(const T* shared, Side side) {
  const auto at = [shared, side](int number) -> const T& { return shared[index_of(side, number)]; };
  ViewNumbers<T> n{at(kColumn),    at(kRow),     at(kRim),     at(kAzimuth),       at(kTiltX),
                   at(kTiltY),     at(kOffsetX), at(kOffsetY), at(kApex),          at(kMirrorRadius),
                   at(kLensToTip), at(kK1),      at(kK2),      shared[kLensHeight]};
  if (side == Side::kUpper) {
    n.azimuth += shared[index_of(Side::kLower, kAzimuth)];
    n.offset_x += shared[index_of(Side::kLower, kOffsetX)];
    n.offset_y += shared[index_of(Side::kLower, kOffsetY)];
    n.lens_height += shared[index_of(Side::kLower, kLensToTip)] + shared[kSeparation] - n.lens_to_tip;
  }
  return n;
}

/// v (equation 2 of the paper, any cone).
template <typename T>
T focal_length(const ViewNumbers<T>& n) {
  using std::tan;
  return (n.lens_to_tip / n.mirror_radius + T(1) / tan(n.apex / T(2))) * n.rim_px;
}

/// Maps an undistorted pixel to the camera's pixel, in place.
template <typename T>
void distort(const ViewNumbers<T>& n, const ViewConstants& c, T* pixel) {
  if (!c.has_lens) return;
  const T x = (pixel[0] - c.principal_px.x()) / c.focal_px.x();
  const T y = (pixel[1] - c.principal_px.y()) / c.focal_px.y();
  const auto& [p1, p2, k3, k4, k5, k6] = c.further;
  const T rr = x * x + y * y;
  const T scale = (T(1) + rr * (n.k1 + rr * (n.k2 + rr * k3))) / (T(1) + rr * (k4 + rr * (k5 + rr * k6)));
  pixel[0] = c.principal_px.x() + c.focal_px.x() * (x * scale + 2 * p1 * x * y + p2 * (rr + T(2) * x * x));
  pixel[1] = c.principal_px.y() + c.focal_px.y() * (y * scale + p1 * (rr + T(2) * y * y) + 2 * p2 * x * y);
}

/// The pixel of the body-frame point (x, y, z).
template <typename T>
void project(const ViewNumbers<T>& n, const ViewConstants& c, const T& x, const T& y, const T& z, T* pixel) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  // p_U = (R_y R_x)^T (p - lens)
  const T px = x - n.offset_x;
  const T py = y - n.offset_y;
  const T pz = z - n.lens_height;
  const T qz = sin(n.tilt_y) * px + cos(n.tilt_y) * pz;
  const T ux = cos(n.tilt_y) * px - sin(n.tilt_y) * pz;
  const T uy = cos(n.tilt_x) * py + sin(n.tilt_x) * qz;
  const T uz = -sin(n.tilt_x) * py + cos(n.tilt_x) * qz;

  const T rho = sqrt(ux * ux + uy * uy);
  const T out = rho + n.lens_to_tip * sin(n.apex);
  const T up = uz - n.lens_to_tip * (T(1) - cos(n.apex));
  const T h = focal_length(n) * (sin(n.apex) * up - cos(n.apex) * out) / (cos(n.apex) * up + sin(n.apex) * out);
  // Image angle: +-(bearing - azimuth), by addition theorems: no atan2, no wrap.
  const T cosine = (ux * cos(n.azimuth) + uy * sin(n.azimuth)) / rho;
  const T sine = (uy * cos(n.azimuth) - ux * sin(n.azimuth)) / rho;
  pixel[0] = n.column + h * cosine;
  pixel[1] = n.row + c.sense * h * sine;
  distort(n, c, pixel);
}

/// The pixel of the near point of a landmark's top, for a landmark at `place` and the body at `pose` (x, y, heading) in
/// the world.
template <typename T>
void project_near_point(const ViewNumbers<T>& n, const ViewConstants& c, const Landmark& landmark, const T* place,
                        const T* pose, T* pixel) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T wx = place[0] - pose[0];
  const T wy = place[1] - pose[1];
  const T bx = cos(pose[2]) * wx + sin(pose[2]) * wy;
  const T by = cos(pose[2]) * wy - sin(pose[2]) * wx;
  const T ox = bx - n.offset_x;
  const T oy = by - n.offset_y;
  const T share = landmark.radius_m / sqrt(ox * ox + oy * oy);
  project(n, c, bx - share * ox, by - share * oy, T(landmark.top_m), pixel);
}

/// The rim's circle in the camera's image: centre and radius. Where a lens bends it, both are means over its points.
template <typename T>
void rim_circle(const ViewNumbers<T>& n, const ViewConstants& c, T* circle) {
  using std::sqrt;
  circle[0] = n.column;
  circle[1] = n.row;
  circle[2] = n.rim_px;
  if (!c.has_lens) return;
  constexpr int kPoints = 24;
  T points[kPoints][2];
  circle[0] = circle[1] = circle[2] = T(0);
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    points[i][0] = n.column + n.rim_px * std::cos(angle);
    points[i][1] = n.row + n.rim_px * std::sin(angle);
    distort(n, c, points[i]);
    circle[0] += points[i][0] / T(kPoints);
    circle[1] += points[i][1] / T(kPoints);
  }
  for (const auto& point : points) {
    const T dx = point[0] - circle[0];
    const T dy = point[1] - circle[1];
    circle[2] += sqrt(dx * dx + dy * dy) / T(kPoints);
  }
}

/// The pose reached from (0, 0, 0) by the wheels' increments: exact arcs, one for each reading. `slips` are relative,
/// left and right.
template <typename T>
void drive(const T& radius, const T& ratio, const T& separation, const T* slips,
           const std::vector<Eigen::Vector2d>& turns_rad, T* pose) {
  using std::abs;
  using std::cos;
  using std::sin;
  // The mean of both radii is `radius`; the right one over the left one is `ratio`.
  const T left = T(2) * radius / (T(1) + ratio) * (T(1) + slips[0]);
  const T right = T(2) * radius * ratio / (T(1) + ratio) * (T(1) + slips[1]);
  pose[0] = pose[1] = pose[2] = T(0);
  for (const Eigen::Vector2d& turns : turns_rad) {
    const T way = (right * turns.y() + left * turns.x()) / T(2);
    const T turn = (right * turns.y() - left * turns.x()) / separation;
    const T half = turn / T(2);
    // Below a thousandth the series is exact to rounding: the next term is half^4 / 120.
    const T sinc = abs(half) < T(1e-3) ? T(1) - half * half / T(6) : sin(half) / half;
    pose[0] += way * sinc * cos(pose[2] + half);
    pose[1] += way * sinc * sin(pose[2] + half);
    pose[2] += turn;
  }
}

}  // namespace twocone::vision::calibration

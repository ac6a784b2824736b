// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "vision/calibration/bundle.h"

/// The residuals of a bundle as functions of its unknowns, for any number type, such as one that carries derivatives.
///
/// They repeat MirrorView::project and near_top_point in that form, and a test checks that both agree. There is one
/// difference: the formulas continue smoothly beyond the rim, where MirrorView has no answer.
namespace twocone::vision::calibration {

// These serve double; other number types come with such functions of their own.
using std::abs;
using std::cos;
using std::sin;
using std::sqrt;
using std::tan;

template <typename T>
struct ViewNumbers {
  T column, row, rim_px, azimuth, tilt_x, tilt_y, offset_x, offset_y, apex, mirror_radius, lens_to_tip, k1, k2,
      lens_height;
};

template <typename T>
ViewNumbers<T> view_numbers(const T* shared, Side side) {
  const auto at = [shared, side](int number) -> const T& { return shared[rig_number(side, number)]; };
  ViewNumbers<T> n{at(kColumn),    at(kRow),     at(kRim),     at(kAzimuth),       at(kTiltX),
                   at(kTiltY),     at(kOffsetX), at(kOffsetY), at(kApex),          at(kMirrorRadius),
                   at(kLensToTip), at(kK1),      at(kK2),      shared[kLensHeight]};
  if (side == Side::kUpper) {
    n.azimuth += shared[rig_number(Side::kLower, kAzimuth)];
    n.offset_x += shared[rig_number(Side::kLower, kOffsetX)];
    n.offset_y += shared[rig_number(Side::kLower, kOffsetY)];
    n.lens_height += shared[rig_number(Side::kLower, kLensToTip)] + shared[kSeparation] - n.lens_to_tip;
  }
  return n;
}

/// Returns v (equation 2 of the paper, for any cone).
template <typename T>
T focal_length(const ViewNumbers<T>& n) {
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

/// Computes the pixel of the body-frame point (x, y, z).
template <typename T>
void project(const ViewNumbers<T>& n, const ViewConstants& c, const T& x, const T& y, const T& z, T* pixel) {
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

/// Computes the pixel of the near point of a landmark's top. @param landmark its LandmarkNumbers @param pose of the
/// body (x, y, heading) in the world
template <typename T>
void project_near_point(const ViewNumbers<T>& n, const ViewConstants& c, const T* landmark, const T* pose, T* pixel) {
  const T wx = landmark[kPlaceX] - pose[0];
  const T wy = landmark[kPlaceY] - pose[1];
  const T bx = cos(pose[2]) * wx + sin(pose[2]) * wy;
  const T by = cos(pose[2]) * wy - sin(pose[2]) * wx;
  const T ox = bx - n.offset_x;
  const T oy = by - n.offset_y;
  const T share = landmark[kRadius] / sqrt(ox * ox + oy * oy);
  project(n, c, bx - share * ox, by - share * oy, landmark[kTop], pixel);
}

/// Computes the rim's circle in the camera's image: centre and radius. If a lens bends it, both are means over points.
template <typename T>
void rim_circle(const ViewNumbers<T>& n, const ViewConstants& c, T* circle) {
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

/// Computes the pose reached from (0, 0, 0) by the wheels' increments, along one exact arc for each reading. `slips`
/// are relative, left and right.
template <typename T>
void drive(const T& radius, const T& ratio, const T& separation, const T* slips,
           const std::vector<Eigen::Vector2d>& turns_rad, T* pose) {
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

template <typename T>
using Numbers = std::array<T, kSharedNumbers>;

template <typename T>
Numbers<T> numbers_of(const SharedModel& model, const T* unknowns) {
  Numbers<T> numbers;
  for (int i = 0; i < kSharedNumbers; ++i) numbers[std::size_t(i)] = model.mean[i] + model.sigma[i] * unknowns[i];
  return numbers;
}

/// Returns the value of a number without its derivatives. Jet is that of Ceres.
inline double plain(double number) { return number; }
template <typename Jet>
double plain(const Jet& number) {
  return number.a;
}

/// Subtracts whole turns from an angle, which then lies within half a turn. Whole turns matter only here.
template <typename T>
T within_half_a_turn(const T& angle) {
  return angle - T(2 * std::numbers::pi * std::round(plain(angle) / (2 * std::numbers::pi)));
}

/// Moves `pose` by `time_s` of that twist, along the arc's chord. The twist was computed with the believed wheels. For
/// the wheels of `numbers` it is scaled by their radius, and its turn also by the inverse of their separation.
template <typename T>
void move_along(const SharedModel& model, const Numbers<T>& numbers, const BodyTwist& twist, const T& time_s,
                const T* pose, T* moved) {
  T way = twist.forward_mps * time_s;
  T turn = twist.turn_radps * time_s;
  if (model.has_wheels) {
    const T larger = numbers[kWheelRadius] / T(model.mean[kWheelRadius]);
    way *= larger;
    turn *= larger * T(model.mean[kWheelSeparation]) / numbers[kWheelSeparation];
  }
  const T along = pose[2] + turn / T(2);
  moved[0] = pose[0] + way * cos(along);
  moved[1] = pose[1] + way * sin(along);
  moved[2] = pose[2] + turn;
}

/// Computes a sighting's residual, px. `shift` is that of the landmark's numbers, in their sigmas.
template <typename T>
void sighting_residual(const SharedModel& model, const SightingRow& row, const T* unknowns, const T* pose,
                       const T* shift, T* residual) {
  const Numbers<T> numbers = numbers_of(model, unknowns);
  const bool is_lower = row.side == Side::kLower;
  T late = row.late_s + row.readout_share * numbers[is_lower ? kLowerReadout : kUpperReadout];
  if (!is_lower) late += numbers[kSkew];
  T seen_from[3];
  move_along(model, numbers, row.twist, late, pose, seen_from);
  const LandmarkVector mean = numbers_of(row.landmark);
  const LandmarkVector sigma = sigmas_of(row.landmark);
  T landmark[kLandmarkNumbers];
  for (int i = 0; i < kLandmarkNumbers; ++i) landmark[i] = mean[i] + sigma[i] * shift[i];
  T pixel[2];
  project_near_point(view_numbers(numbers.data(), row.side), model.views[is_lower ? 0 : 1], landmark, seen_from, pixel);
  residual[0] = row.pixel_px.x() - pixel[0];
  residual[1] = row.pixel_px.y() - pixel[1];
}

/// Computes the residuals of the motion, (x, y, heading), then of both slips; all are whitened. `seen_from` and
/// `seen_to` are the images' poses.
template <typename T>
void wheel_residual(const SharedModel& model, const WheelRow& row, const T* unknowns, const T* seen_from,
                    const T* seen_to, const T* last_slips, const T* slips, T* residual) {
  const Numbers<T> numbers = numbers_of(model, unknowns);
  T from[3];
  T to[3];
  move_along(model, numbers, row.from_twist, numbers[kLatency], seen_from, from);
  move_along(model, numbers, row.to_twist, numbers[kLatency], seen_to, to);
  const T relative[2] = {slips[0] * T(model.wheels.slip), slips[1] * T(model.wheels.slip)};
  T way[3];
  drive(numbers[kWheelRadius], numbers[kWheelRatio], numbers[kWheelSeparation], relative, row.turns_rad, way);
  const T dx = to[0] - from[0];
  const T dy = to[1] - from[1];
  const T error[3] = {cos(from[2]) * dx + sin(from[2]) * dy - way[0], cos(from[2]) * dy - sin(from[2]) * dx - way[1],
                      within_half_a_turn<T>(to[2] - from[2] - way[2])};
  for (int i = 0; i < 3; ++i) {
    residual[i] = T(0);
    for (int j = 0; j < 3; ++j) residual[i] += row.whitener(i, j) * error[j];
  }
  for (int side = 0; side < 2; ++side) {
    residual[3 + side] = (slips[side] - row.slip_share * last_slips[side]) / T(row.slip_sigma);
  }
}

}  // namespace twocone::vision::calibration

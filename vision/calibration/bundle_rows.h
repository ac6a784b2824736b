// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "vision/calibration/bundle.h"
#include "vision/calibration/projection.h"

/// The residuals of a bundle as functions of its unknowns, for any number type.
namespace twocone::vision::calibration {

template <typename T>
using Numbers = std::array<T, kSharedNumbers>;

template <typename T>
Numbers<T> numbers_of(const SharedModel& model, const T* unknowns) {
  Numbers<T> numbers;
  for (int i = 0; i < kSharedNumbers; ++i) numbers[std::size_t(i)] = model.mean[i] + model.sigma[i] * unknowns[i];
  return numbers;
}

/// Subtracts whole turns from an angle. Whole turns matter only here.
template <typename T, typename Plain>
T within_half_a_turn(const T& angle, Plain plain) {
  return angle - T(2 * std::numbers::pi * std::round(plain(angle) / (2 * std::numbers::pi)));
}

/// Moves `pose` by `time_s` of that twist, along the arc's chord. The twist was computed with the believed wheels. For
/// the wheels of `numbers` it is scaled by their radius, and its turn also by the inverse of their separation.
template <typename T>
void move_along(const SharedModel& model, const Numbers<T>& numbers, const BodyTwist& twist, const T& time_s,
                const T* pose, T* moved) {
  using std::cos;
  using std::sin;
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

/// `shift` is that of the landmark, in units of SharedModel::landmark_sigma_m.
template <typename T>
void sighting_residual(const SharedModel& model, const SightingRow& row, const T* unknowns, const T* pose,
                       const T* shift, T* residual) {
  const Numbers<T> numbers = numbers_of(model, unknowns);
  const bool is_lower = row.side == Side::kLower;
  T late = row.late_s + row.readout_share * numbers[is_lower ? kLowerReadout : kUpperReadout];
  if (!is_lower) late += numbers[kSkew];
  T seen_from[3];
  move_along(model, numbers, row.twist, late, pose, seen_from);
  const T place[2] = {row.landmark.x_m + model.landmark_sigma_m * shift[0],
                      row.landmark.y_m + model.landmark_sigma_m * shift[1]};
  T pixel[2];
  project_near_point(view_numbers(numbers.data(), row.side), model.views[is_lower ? 0 : 1], row.landmark, place,
                     seen_from, pixel);
  residual[0] = row.pixel_px.x() - pixel[0];
  residual[1] = row.pixel_px.y() - pixel[1];
}

/// Residuals of the motion, (x, y, heading), then of both slips; all whitened. `seen_from` and `seen_to` are the
/// images' poses.
template <typename T, typename Plain>
void wheel_residual(const SharedModel& model, const WheelRow& row, const T* unknowns, const T* seen_from,
                    const T* seen_to, const T* last_slips, const T* slips, T* residual, Plain plain) {
  using std::cos;
  using std::sin;
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
                      within_half_a_turn<T>(to[2] - from[2] - way[2], plain)};
  for (int i = 0; i < 3; ++i) {
    residual[i] = T(0);
    for (int j = 0; j < 3; ++j) residual[i] += row.whitener(i, j) * error[j];
  }
  for (int side = 0; side < 2; ++side) {
    residual[3 + side] = (slips[side] - row.slip_share * last_slips[side]) / T(row.slip_sigma);
  }
}

}  // namespace twocone::vision::calibration

// SPDX-License-Identifier: Apache-2.0
#include "localisation/trajectory_error.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/errors.h"

namespace twocone::localisation {
namespace {

std::optional<TrajectoryError> summed(const std::vector<Pose>& errors) {
  if (errors.empty()) return std::nullopt;
  TrajectoryError sum;
  sum.count = errors.size();
  for (const Pose& error : errors) {
    const double length_m = std::hypot(error.x_m, error.y_m);
    const double angle_rad = wrap_angle_rad(error.heading_rad);
    sum.mean_m += length_m;
    sum.rmse_m += length_m * length_m;
    sum.max_m = std::max(sum.max_m, length_m);
    sum.rmse_rad += angle_rad * angle_rad;
  }
  const auto count = double(errors.size());
  sum.mean_m /= count;
  sum.rmse_m = std::sqrt(sum.rmse_m / count);
  sum.rmse_rad = std::sqrt(sum.rmse_rad / count);
  return sum;
}

Pose relative(const PosePair& from, const PosePair& to) {
  return seen_from(seen_from(from.reference, to.reference), seen_from(from.estimate, to.estimate));
}

}  // namespace

Pose moved(const Pose& frame, const Pose& pose) {
  const double c = std::cos(frame.heading_rad);
  const double s = std::sin(frame.heading_rad);
  return {frame.x_m + c * pose.x_m - s * pose.y_m, frame.y_m + s * pose.x_m + c * pose.y_m,
          wrap_angle_rad(frame.heading_rad + pose.heading_rad)};
}

Pose seen_from(const Pose& frame, const Pose& pose) {
  const double c = std::cos(frame.heading_rad);
  const double s = std::sin(frame.heading_rad);
  const double dx_m = pose.x_m - frame.x_m;
  const double dy_m = pose.y_m - frame.y_m;
  return {c * dx_m + s * dy_m, c * dy_m - s * dx_m, wrap_angle_rad(pose.heading_rad - frame.heading_rad)};
}

std::optional<TrajectoryError> absolute_error(std::span<const PosePair> pairs) {
  std::vector<Pose> errors;
  for (const PosePair& pair : pairs) errors.push_back(seen_from(pair.reference, pair.estimate));
  return summed(errors);
}

std::optional<TrajectoryError> relative_error(std::span<const PosePair> pairs, std::size_t delta) {
  if (delta == 0) throw std::invalid_argument("relative_error: delta is 0, must be >= 1");
  std::vector<Pose> errors;
  for (std::size_t i = 0; i + delta < pairs.size(); i += delta) errors.push_back(relative(pairs[i], pairs[i + delta]));
  return summed(errors);
}

std::vector<std::size_t> stretches(std::span<const PosePair> pairs, double delta_m) {
  if (!(delta_m > 0)) throw base::InvalidArgument("stretches: delta_m is {}, must be > 0", delta_m);
  std::vector<std::size_t> ends;
  double gone_m = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i > 0) {
      const Pose& last = pairs[i - 1].reference;
      const Pose& now = pairs[i].reference;
      gone_m += std::hypot(now.x_m - last.x_m, now.y_m - last.y_m);
      if (gone_m < delta_m) continue;
    }
    ends.push_back(i);
    gone_m = 0;
  }
  return ends;
}

std::optional<TrajectoryError> relative_error_over(std::span<const PosePair> pairs, double delta_m) {
  const std::vector<std::size_t> ends = stretches(pairs, delta_m);
  std::vector<Pose> errors;
  for (std::size_t k = 1; k < ends.size(); ++k) errors.push_back(relative(pairs[ends[k - 1]], pairs[ends[k]]));
  return summed(errors);
}

std::optional<Pose> alignment(std::span<const PosePair> pairs) {
  if (pairs.size() < 2) return std::nullopt;
  const auto count = double(pairs.size());
  double rx = 0, ry = 0, ex = 0, ey = 0;
  for (const PosePair& pair : pairs) {
    rx += pair.reference.x_m / count;
    ry += pair.reference.y_m / count;
    ex += pair.estimate.x_m / count;
    ey += pair.estimate.y_m / count;
  }
  // The best rotation of points in the plane is the angle of the sum of conj(estimate) * reference about the means.
  double along = 0, across = 0, size = 0;
  for (const PosePair& pair : pairs) {
    const double ax = pair.estimate.x_m - ex, ay = pair.estimate.y_m - ey;
    const double bx = pair.reference.x_m - rx, by = pair.reference.y_m - ry;
    along += ax * bx + ay * by;
    across += ax * by - ay * bx;
    size += std::hypot(ax, ay) * std::hypot(bx, by);
  }
  constexpr double kLeastShare = 1e-12;  // a smaller share is rounding: no direction is distinct
  if (!(std::hypot(along, across) > kLeastShare * size)) return std::nullopt;
  const double heading_rad = std::atan2(across, along);
  const Pose turned = moved({0, 0, heading_rad}, {ex, ey, 0});
  return Pose{rx - turned.x_m, ry - turned.y_m, heading_rad};
}

}  // namespace twocone::localisation

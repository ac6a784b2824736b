// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "localisation/least_squares_fix.h"

namespace twocone::localisation {

std::optional<Eigen::Matrix3d> pose_bound(const Pose& pose, std::span<const Eigen::Vector2d> landmarks_m,
                                          std::span<const Eigen::Matrix2d> information) {
  if (landmarks_m.size() != information.size()) {
    throw std::invalid_argument(
        fmt::format("pose_bound: {} landmarks, but information of {}", landmarks_m.size(), information.size()));
  }
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < landmarks_m.size(); ++i) {
    const double dx_m = landmarks_m[i].x() - pose.x_m;
    const double dy_m = landmarks_m[i].y() - pose.y_m;
    const double range_m = std::hypot(dx_m, dy_m);
    if (range_m == 0) continue;  // no gradient there
    const double ux = dx_m / range_m;
    const double uy = dy_m / range_m;
    Eigen::Matrix<double, 2, 3> j;
    j << -ux, -uy, 0, uy / range_m, -ux / range_m, -1;
    sum += j.transpose() * information[i] * j;
  }
  if (!sum.allFinite() || !(sum.diagonal().minCoeff() > 0)) return std::nullopt;
  // Scale to unit diagonal first, since metres and radians are mixed.
  const Eigen::Vector3d scale = sum.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::Matrix3d scaled = scale.asDiagonal() * sum * scale.asDiagonal();
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(scaled);
  // Each of the sum's terms was rounded by a few units.
  const double rounding = 16 * std::numeric_limits<double>::epsilon() * double(landmarks_m.size() + 3);
  if (!(ldlt.vectorD().minCoeff() > rounding)) return std::nullopt;
  const Eigen::Matrix3d inverse = ldlt.solve(Eigen::Matrix3d::Identity());
  const Eigen::Matrix3d symmetric = (inverse + inverse.transpose()) / 2;
  const Eigen::Matrix3d bound = scale.asDiagonal() * symmetric * scale.asDiagonal();
  if (!bound.allFinite()) return std::nullopt;  // too large for a double
  return bound;
}

}  // namespace twocone::localisation

// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/map_bounds.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace twocone::estimation {
namespace {

bool is_outside(const config::Bounds& bounds, const std::optional<Eigen::Vector2d>& position_m,
                const std::optional<Eigen::Matrix3d>& covariance) {
  if (!position_m || !covariance) return false;
  const Eigen::Vector2d nearest_m(std::clamp(position_m->x(), bounds.min_x_m, bounds.max_x_m),
                                  std::clamp(position_m->y(), bounds.min_y_m, bounds.max_y_m));
  const Eigen::Vector2d out_m = *position_m - nearest_m;
  const double distance_m = out_m.norm();
  if (distance_m == 0) return false;
  const Eigen::Vector2d normal = out_m / distance_m;
  return distance_m > kOutsideSigmas * std::sqrt(normal.dot(covariance->topLeftCorner<2, 2>() * normal));
}

}  // namespace

void check_bounds(const config::Bounds& bounds, localisation::Fix& fix) {
  using localisation::FixVerdict;
  if (fix.verdict != FixVerdict::kOk && fix.verdict != FixVerdict::kAmbiguous) return;
  const bool is_ambiguous = fix.verdict == FixVerdict::kAmbiguous;
  const bool is_first_out = is_outside(bounds, fix.position_m, fix.covariance);
  const bool is_other_out = is_ambiguous && is_outside(bounds, fix.other_position_m, fix.other_covariance);
  if (!is_first_out && !is_other_out) return;
  if (is_ambiguous && is_first_out != is_other_out) {
    fix.verdict = FixVerdict::kOk;
    if (is_first_out) {
      fix.position_m = fix.other_position_m;
      fix.heading_rad = fix.other_heading_rad;
      fix.covariance = fix.other_covariance;
    }
  } else {
    fix.verdict = FixVerdict::kOutOfBounds;
  }
  fix.other_position_m.reset();
  fix.other_heading_rad.reset();
  fix.other_covariance.reset();
}

}  // namespace twocone::estimation

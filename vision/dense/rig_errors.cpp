// SPDX-License-Identifier: Apache-2.0
#include "vision/dense/rig_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/plane.h"

namespace twocone::vision {
namespace {

// Nodes of the table. The errors of a rig vary with the azimuth as tilts and shifts do: by its sine, and slowly with
// the rest.
constexpr int kAzimuths = 24;
constexpr int kSlopes = 6;
constexpr int kDistances = 5;

double node_bearing_rad(int node) { return -std::numbers::pi + 2 * std::numbers::pi * node / kAzimuths; }
/// Inverse distances: from that of the nearest to one far away.
double node_inverse(int node, double nearest_m) { return (1 - double(node) / kDistances) / nearest_m; }

/// Returns the horizontal distance at which the rays of two pixels meet in the upright plane of a bearing.
std::optional<double> meeting_m(const Rig& rig, const Eigen::Vector2d& along,
                                const std::array<Eigen::Vector2d, 2>& px) {
  std::array<double, 2> height_m{};
  std::array<double, 2> slope{};
  for (const Side side : {Side::kLower, Side::kUpper}) {
    const auto ray = of_view(rig, side).back_project(px[std::size_t(side)], Rim::kGoesOn);
    if (!ray) return std::nullopt;
    slope[std::size_t(side)] = ray->direction.z() / ray->direction.head<2>().dot(along);
    height_m[std::size_t(side)] = ray->origin_m.z() - slope[std::size_t(side)] * ray->origin_m.head<2>().dot(along);
  }
  if (slope[0] == slope[1]) return std::nullopt;
  return (height_m[1] - height_m[0]) / (slope[0] - slope[1]);
}

}  // namespace

RigErrorsOfRange::RigErrorsOfRange(const UncertainRig& rig, const PanoramaGrid& grid, double nearest_m)
    : grid_(grid), nearest_m_(nearest_m) {
  if (rig.is_exact()) return;
  std::vector<std::array<Rig, 2>> stepped;
  for (Eigen::Index k = 0; k < rig.errors(); ++k) {
    const Eigen::VectorXd errors = rig.by_shared().col(k);
    if (errors.isZero(0)) continue;
    // The rig's believed numbers minus their errors, and plus them: what is measured with them lies on either side.
    stepped.push_back({with_errors(rig.rig(), -errors), with_errors(rig.rig(), errors)});
  }
  const MirrorView& lower = rig.rig().lower;
  const double tip_m = lower.settings().lens_height_m + lower.settings().cone.lens_to_tip_m;
  for (int a = 0; a < kAzimuths; ++a) {
    const double bearing_rad = node_bearing_rad(a);
    const Eigen::Vector2d along(std::cos(bearing_rad), std::sin(bearing_rad));
    for (int i = 0; i < kSlopes; ++i) {
      const double slope = grid.slope(double(i) / (kSlopes - 1) * (grid.slopes - 1));
      for (int k = 0; k < kDistances; ++k) {
        const double distance_m = 1 / node_inverse(k, nearest_m);
        const Eigen::Vector2d place_m = distance_m * along;
        const Eigen::Vector3d point(place_m.x(), place_m.y(), tip_m + slope * distance_m);
        const auto lower_px = lower.project_with_jacobian(point, Rim::kGoesOn);
        const auto upper_px = rig.rig().upper.project_with_jacobian(point, Rim::kGoesOn);
        double variance = 0;
        if (lower_px && upper_px) {
          for (const auto& [less, more] : stepped) {
            const std::array pixels{lower_px->pixel_px, upper_px->pixel_px};
            const auto a_m = meeting_m(less, along, pixels);
            const auto b_m = meeting_m(more, along, pixels);
            // Inverse distances are linear in small errors also where a distance goes to infinity.
            if (a_m && b_m) variance += std::pow((1 / *b_m - 1 / *a_m) / 2, 2);
          }
        }
        sigmas_.push_back(static_cast<float>(std::sqrt(variance)));
      }
    }
  }
}

double RigErrorsOfRange::sigma_m(int azimuth, int slope, double along_m) const {
  if (sigmas_.empty()) return 0;
  struct Between {
    int first, second;
    double share;
  };
  const auto between = [](double at, int last) {
    const int first = std::clamp(static_cast<int>(std::floor(at)), 0, last - 1);
    return Between{first, first + 1, std::clamp(at - first, 0.0, 1.0)};
  };
  Between a = between((azimuth + 0.5) / grid_.azimuths * kAzimuths, kAzimuths);
  a.second %= kAzimuths;
  const Between i = between(double(slope) / (grid_.slopes - 1) * (kSlopes - 1), kSlopes - 1);
  const Between k = between((1 - nearest_m_ / std::max(along_m, nearest_m_)) * kDistances, kDistances - 1);
  const auto at = [&](int azimuth_node, int slope_node, int distance_node) {
    return double(sigmas_[std::size_t(azimuth_node * kSlopes + slope_node) * kDistances + std::size_t(distance_node)]);
  };
  const auto along_distance = [&](int x, int y) { return std::lerp(at(x, y, k.first), at(x, y, k.second), k.share); };
  const auto along_slope = [&](int x) {
    return std::lerp(along_distance(x, i.first), along_distance(x, i.second), i.share);
  };
  return std::lerp(along_slope(a.first), along_slope(a.second), a.share) * along_m * along_m;
}

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "base/plane.h"

/// Maps of one room in different worlds.
namespace twocone::survey {

/// Two maps of one room agree if so many landmarks of one lie on landmarks of the other.
constexpr std::size_t kLeastShared = 3;

/// Returns the index of the landmark of that colour within 0.35 m of that place.
std::optional<std::size_t> same_landmark(const Landmark& landmark, const std::vector<Landmark>& among);

/// The motion that lays one map onto another.
struct Overlay {
  double heading_rad = 0;
  Eigen::Vector2d shift_m = Eigen::Vector2d::Zero();
  std::size_t agree = 0;  ///< landmarks that lie on one of their colour

  [[nodiscard]] Eigen::Vector2d moved(const Eigen::Vector2d& place_m) const;
  [[nodiscard]] Landmark moved(Landmark landmark) const;
  [[nodiscard]] Eigen::Vector3d moved(const Pose2& pose) const;
};

/// Returns the overlay with which most landmarks agree, tried for every two of them. Landmarks without a name are left
/// out.
Overlay best_overlay(const std::vector<Landmark>& landmarks, const std::vector<Landmark>& onto);

}  // namespace twocone::survey

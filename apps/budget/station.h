// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "localisation/fix.h"
#include "localisation/odometry.h"
#include "vision/mirror_view.h"
#include "vision/sighting.h"
#include "vision/triangulation.h"

namespace twocone::budget {

struct Pillar {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< world frame
  double radius_m = 0;
  double top_m = 0;
};

/// What a robot believes, and what else may differ from the ideal. The true one has neither skew nor noise.
struct World {
  vision::MirrorViewSettings lower, upper;
  std::vector<Pillar> pillars;
  double skew_s = 0;  ///< of the upper exposure after the lower one
  /// Of each pillar's pixel in each view, in standard deviations along two independent axes; empty: none.
  std::vector<std::array<Eigen::Vector2d, 2>> noise;
};

struct Motion {
  double speed_mps = 0;
  double turn_rate_radps = 0;
};

/// Range and bearing of one pillar as a robot answers it.
struct Answer {
  Eigen::Vector2d range_bearing;
  Eigen::Matrix2d covariance;
};

/// One true pose in the true world, from which answers are asked that rest on wrong beliefs.
class Station {
 public:
  /// @param edge_noise_px > 0. @param tops_known the robot uses its belief about the tops' heights
  Station(const World& truth, const localisation::Pose& pose, const Motion& motion, double edge_noise_px,
          bool tops_known);

  [[nodiscard]] const localisation::Pose& pose() const { return pose_; }
  /// Indices of the pillars that can be measured from here.
  [[nodiscard]] const std::vector<int>& seen() const { return seen_; }
  [[nodiscard]] Eigen::Vector2d true_range_bearing(int pillar) const;

  /// @param rig the two views of `believed`. Nothing where the triangulation withholds its range
  [[nodiscard]] std::optional<Answer> answer(const World& believed, const vision::Rig& rig, int pillar) const;
  /// Nothing where fewer than enough pillars have an answer.
  [[nodiscard]] std::optional<localisation::Fix> fix(const World& believed, const vision::Rig& rig) const;

 private:
  struct View {
    vision::Sighting sighting;  ///< without noise
    Eigen::Matrix2d root_px;    ///< of the true covariance: noise = root * standard normals
  };
  [[nodiscard]] Eigen::Vector2d p_BL_m(const localisation::Pose& pose, int pillar) const;
  [[nodiscard]] std::optional<Eigen::Vector2d> pixel(const vision::MirrorView& view, const localisation::Pose& pose,
                                                     int pillar) const;
  [[nodiscard]] std::optional<View> look(const vision::MirrorView& view, int pillar, double edge_noise_px) const;

  const World* truth_;
  vision::Rig rig_;
  localisation::Pose pose_;
  Motion motion_;
  bool tops_known_;
  std::vector<int> seen_;
  std::vector<std::array<std::optional<View>, 2>> views_;  ///< of each pillar, lower and upper
  std::vector<double> inflation_;                          ///< of each pillar's sigmas
};

vision::Rig rig_of(const World& world);

}  // namespace twocone::budget
